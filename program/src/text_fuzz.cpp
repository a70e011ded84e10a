#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <nms/program/text.h>

#include "test_programs.h"

namespace {

using namespace nms::program;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

/// Any bytes are read or refused; what is read and makes a program is a fixed point from its first printing on.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto draft = from_text({reinterpret_cast<const char*>(data), size}, "fuzz");
  if (!draft) {
    require(!draft.error().cause.empty());
    return 0;
  }
  const auto image = Image::from(*draft);
  if (!image) {
    require(image.error().kind == "invalid_program");
    return 0;
  }
  exercise(image->program());
  const std::string text = to_text(image->program());
  const auto again = from_text(text, "fuzz");
  require(again.has_value());
  const auto second = Image::from(*again);
  require(second.has_value() && to_text(second->program()) == text);
  return 0;
}
