#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include <nms/program/failure.h>
#include <nms/program/records.h>

namespace nms::program {

/// A checked AU curve program with its rig description: spans over bytes that somebody else owns.
///
/// Only `check()` and `Image` make one, so whoever holds a Program may index it without further checks.
struct Program {
  std::span<const Track> tracks;
  std::span<const Channel> channels;
  std::span<const Clip> clips;  ///< ordered as declared
  std::span<const Curve> curves;
  std::span<const Knot> knots;
  std::span<const Handles> handles;
  std::span<const Marker> markers;
  std::span<const std::uint32_t> knot_sources;  ///< one for each knot: index into sources or kNone; or empty
  std::span<const Source> sources;
  std::span<const Muscle> muscles;
  std::span<const Actuation> actuations;
  std::span<const Landmark> landmarks;
  std::span<const FaceReference> faces;
  std::span<const FacePart> face_parts;         ///< of that face, as declared
  std::span<const std::uint32_t> string_begin;  ///< offsets into string_bytes, one more than there are strings
  std::span<const char> string_bytes;           ///< UTF-8
  std::span<const Input> inputs;                ///< all that the compiler read, in its order; or empty: not known

  /// @pre id is of this program
  [[nodiscard]] std::string_view string(StringId id) const;
  /// The inner control values of a knot's segment.
  /// @pre knot is of curve, and its shape is none of the named
  [[nodiscard]] const Handles& handles_of(const Curve& curve, const Knot& knot) const {
    return handles[std::size_t{curve.first_handle} + knot.shape];
  }
  /// The clip of that name, or nullptr.
  [[nodiscard]] const Clip* find_clip(std::string_view name) const;
};

/// What a compiler fills in: the same tables, owned and growing. Not yet checked.
struct Draft {
  std::vector<Track> tracks;
  std::vector<Channel> channels;
  std::vector<Clip> clips;
  std::vector<Curve> curves;
  std::vector<Knot> knots;
  std::vector<Handles> handles;
  std::vector<Marker> markers;
  std::vector<std::uint32_t> knot_sources;
  std::vector<Source> sources;
  std::vector<Muscle> muscles;
  std::vector<Actuation> actuations;
  std::vector<Landmark> landmarks;
  std::vector<FaceReference> faces;
  std::vector<FacePart> face_parts;
  std::vector<std::string> strings{std::string()};  ///< [0] is the empty string
  std::vector<Input> inputs;
};

/// XXH3-64 of a source's bytes: what `Input::hash` holds.
[[nodiscard]] std::uint64_t text_hash(std::string_view text);

/// The `.auc` bytes of a draft. Deterministic: the same draft gives the same bytes on every machine.
[[nodiscard]] std::vector<std::byte> encode(const Draft& draft);

/// Checks every offset, count, order, index, enumerator and number of an `.auc` image before a byte is trusted.
/// @param bytes aligned to 8; must outlive the result
/// @param place what to call the bytes in a failure: a path, or "-"
/// Failures: not_a_program, newer_version, older_version, truncated_program, corrupt_program (checksum),
/// invalid_program (a table).
[[nodiscard]] tl::expected<Program, Failure> check(std::span<const std::byte> bytes, std::string_view place);

/// A program together with the bytes it lies in. Movable, not copyable.
class Image {
 public:
  /// Takes the bytes and checks them.
  [[nodiscard]] static tl::expected<Image, Failure> load(std::span<const std::byte> bytes, std::string_view place);
  /// Encodes and checks a draft; that it passes is our own promise, so a failure here is a defect of the compiler.
  [[nodiscard]] static tl::expected<Image, Failure> from(const Draft& draft);

  Image(Image&&) noexcept = default;
  Image& operator=(Image&&) noexcept = default;
  Image(const Image&) = delete;
  Image& operator=(const Image&) = delete;

  [[nodiscard]] const Program& program() const { return program_; }
  [[nodiscard]] std::span<const std::byte> bytes() const;

 private:
  Image() = default;
  std::vector<std::uint64_t> storage_;  ///< aligned copy of the bytes
  std::size_t size_ = 0;
  Program program_;
};

}  // namespace nms::program
