#include <cstring>
#include <utility>

#include <nms/program/program.h>

namespace nms::program {

tl::expected<Image, Failure> Image::load(std::span<const std::byte> bytes, std::string_view place) {
  Image image;
  image.size_ = bytes.size();
  image.storage_.resize((bytes.size() + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t));
  if (!bytes.empty()) {
    std::memcpy(image.storage_.data(), bytes.data(), bytes.size());
  }
  tl::expected<Program, Failure> program = check(image.bytes(), place);
  if (!program) {
    return tl::make_unexpected(std::move(program.error()));
  }
  image.program_ = *program;
  return image;
}

tl::expected<Image, Failure> Image::from(const Draft& draft) { return load(encode(draft), "the compiled program"); }

std::span<const std::byte> Image::bytes() const { return {reinterpret_cast<const std::byte*>(storage_.data()), size_}; }

}  // namespace nms::program
