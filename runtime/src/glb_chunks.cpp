#include "glb_chunks.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

namespace nms::runtime {
namespace {

// glTF 2.0, 4.4: three words of header, then chunks of length, type, data; all little-endian.
constexpr std::uint32_t kMagic = 0x46546C67U;
constexpr std::uint32_t kJson = 0x4E4F534AU;
constexpr std::uint32_t kBinary = 0x004E4942U;

// Avatars have one or two. As a document in memory it takes up to sixteen times as much.
constexpr std::size_t kMaxJsonBytes = std::size_t{32} << 20U;
constexpr std::size_t kMaxOthers = 64;

std::uint32_t word(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t w = 0;
  for (std::size_t i = 0; i < 4; ++i) w |= static_cast<std::uint32_t>(bytes[at + i]) << (8 * i);
  return w;
}

void put(std::vector<std::byte>& out, std::size_t value) {
  for (std::size_t i = 0; i < 4; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i) & 0xFFU));
}

/// A chunk whose data is filled up to whole words (glTF 2.0, 4.4.3).
void put_chunk(std::vector<std::byte>& out, std::uint32_t type, std::span<const std::byte> data, std::byte filler) {
  const std::size_t padding = (4 - data.size() % 4) % 4;
  put(out, data.size() + padding);
  put(out, type);
  out.insert(out.end(), data.begin(), data.end());
  out.insert(out.end(), padding, filler);
}

}  // namespace

tl::expected<GlbFile, program::Failure> read_glb(std::span<const std::byte> bytes, const std::string& place) {
  const auto bad = [&](std::string cause) {
    return tl::unexpected(
        program::Failure{"bad_avatar", place, std::move(cause), "give a binary glTF 2.0 file (.glb)"});
  };
  if (bytes.size() < 12 || word(bytes, 0) != kMagic) return bad("it is not a binary glTF file");
  if (word(bytes, 4) != 2) return bad("it is not glTF of version 2");
  if (word(bytes, 8) > bytes.size()) return bad("it is cut short");
  bytes = bytes.first(word(bytes, 8));
  GlbFile out;
  bool first = true;
  bool second = false;
  for (std::size_t at = 12; at + 8 <= bytes.size();) {
    const std::size_t length = word(bytes, at);
    const std::uint32_t type = word(bytes, at + 4);
    if (length > bytes.size() - at - 8) return bad("one of its chunks is cut short");
    const auto data = bytes.subspan(at + 8, length);
    if (first) {
      if (type != kJson) return bad("its first chunk is not JSON");
      if (length > kMaxJsonBytes) return bad(fmt::format("it has more than {} MiB of JSON", kMaxJsonBytes >> 20U));
      out.chunks.text.assign(reinterpret_cast<const char*>(data.data()), data.size());
      out.json = nlohmann::json::parse(out.chunks.text, nullptr, false);
      if (!out.json.is_object()) return bad("its JSON chunk is broken, or no object");
    } else if (type == kBinary && second) {
      out.chunks.binary.assign(data.begin(), data.end());
    } else {
      if (out.chunks.others.size() == kMaxOthers) return bad(fmt::format("it has more than {} chunks", kMaxOthers));
      out.chunks.others.push_back({type, {data.begin(), data.end()}});
    }
    second = first;
    first = false;
    at += 8 + length;
  }
  if (first) return bad("it has no JSON chunk");
  return out;
}

std::vector<std::byte> write_glb(const GlbChunks& chunks) {
  const auto* text = reinterpret_cast<const std::byte*>(chunks.text.data());
  std::vector<std::byte> out;
  out.reserve(64 + chunks.text.size() + chunks.binary.size());
  put(out, kMagic);
  put(out, 2);
  put(out, 0);  // length of the whole, once it is known
  put_chunk(out, kJson, {text, chunks.text.size()}, std::byte{' '});
  if (!chunks.binary.empty()) put_chunk(out, kBinary, chunks.binary, std::byte{0});
  for (const OtherChunk& other : chunks.others) put_chunk(out, other.type, other.data, std::byte{0});
  std::vector<std::byte> length;
  put(length, out.size());
  std::copy(length.begin(), length.end(), out.begin() + 8);
  return out;
}

}  // namespace nms::runtime
