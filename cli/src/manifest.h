#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nms/compiler/lexicon_index.h>
#include <nms/program/program.h>

namespace nms::cli {

/// What one file of assets was made from, and which it is.
struct Asset {
  const compiler::EntryRecord* entry = nullptr;
  const program::Clip* clip = nullptr;
  std::string file;        ///< relative to the manifest
  std::uint64_t hash = 0;  ///< of all that the file's bytes depend on
};

/// Names of the action units that a clip moves, axes as those of their two that it goes to.
[[nodiscard]] std::vector<std::string> units_moved(const program::Program& program, const program::Clip& clip);

/// The manifest of a lexicon's assets, as JSON: what stands in the entries, what was measured in the clips, and hashes.
[[nodiscard]] std::string write_manifest(const compiler::LexiconRecord& lexicon,
                                         const compiler::FaceRecord& face_record, const std::string& face,
                                         const program::Program& program, const std::vector<Asset>& assets);

/// Hashes by file of a manifest that was written before. Anything that is not one: empty.
[[nodiscard]] std::map<std::string, std::uint64_t> read_manifest_hashes(std::string_view text);

}  // namespace nms::cli
