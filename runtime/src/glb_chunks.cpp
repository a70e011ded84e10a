#include "glb_chunks.h"

#include <cstdint>
#include <cstring>
#include <string_view>

namespace nms::runtime {
namespace {

// glTF 2.0, 4.4: three words of header, then chunks of length, type, data; all little-endian.
constexpr std::uint32_t kMagic = 0x46546C67U;
constexpr std::uint32_t kJson = 0x4E4F534AU;
constexpr std::uint32_t kBinary = 0x004E4942U;

std::uint32_t word(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t w = 0;
  for (std::size_t i = 0; i < 4; ++i) w |= static_cast<std::uint32_t>(bytes[at + i]) << (8 * i);
  return w;
}

void put(std::vector<std::byte>& out, std::size_t value) {
  for (std::size_t i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFU));
}

}  // namespace

tl::expected<GlbChunks, program::Failure> read_glb(std::span<const std::byte> bytes, const std::string& place) {
  const auto bad = [&](std::string cause) {
    return tl::unexpected(
        program::Failure{"bad_avatar", place, std::move(cause), "give a binary glTF 2.0 file (.glb)"});
  };
  if (bytes.size() < 12 || word(bytes, 0) != kMagic) return bad("it is not a binary glTF file");
  if (word(bytes, 4) != 2) return bad("it is not glTF of version 2");
  if (word(bytes, 8) > bytes.size()) return bad("it is cut short");
  bytes = bytes.first(word(bytes, 8));
  GlbChunks out;
  bool first = true;
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const std::size_t length = word(bytes, at);
    const std::uint32_t type = word(bytes, at + 4);
    if (length > bytes.size() - at - 8) return bad("one of its chunks is cut short");
    const auto data = bytes.subspan(at + 8, length);
    if (first) {
      if (type != kJson) return bad("its first chunk is not JSON");
      const std::string_view text(reinterpret_cast<const char*>(data.data()), data.size());
      out.json = nlohmann::ordered_json::parse(text.begin(), text.end(), nullptr, false);
      if (!out.json.is_object()) return bad("its JSON chunk does not hold an object");
    } else if (type == kBinary && out.binary.empty()) {
      out.binary.assign(data.begin(), data.end());
    }
    first = false;
    at += 8 + length;
  }
  if (first) return bad("it has no JSON chunk");
  return out;
}

std::vector<std::byte> write_glb(const GlbChunks& chunks) {
  std::string json = chunks.json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::size_t padding = (4 - chunks.binary.size() % 4) % 4;
  const std::size_t binary = chunks.binary.size() + padding;
  std::vector<std::byte> out;
  out.reserve(28 + json.size() + binary);
  put(out, kMagic);
  put(out, 2);
  put(out, 20 + json.size() + (binary != 0 ? 8 + binary : 0));
  put(out, json.size());
  put(out, kJson);
  const auto* text = reinterpret_cast<const std::byte*>(json.data());
  out.insert(out.end(), text, text + json.size());
  if (binary != 0) {
    put(out, binary);
    put(out, kBinary);
    out.insert(out.end(), chunks.binary.begin(), chunks.binary.end());
    out.insert(out.end(), padding, std::byte{0});
  }
  return out;
}

}  // namespace nms::runtime
