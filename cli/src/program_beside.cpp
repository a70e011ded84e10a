#include "program_beside.h"

#include <unordered_map>

#include <nms/program/utf8.h>

namespace nms::cli {
namespace {

constexpr std::string_view kCompiler = "nmsc";
constexpr std::string_view kVersion = NMS_VERSION;
constexpr std::string_view kLibrary = "stdlib/";
constexpr std::string_view kFaces = "stdlib/faces/";

/// Strings of a draft by their text, so that none is added twice.
class Strings {
 public:
  explicit Strings(std::vector<std::string>& strings) : strings_(strings) {
    for (std::size_t i = 0; i < strings.size(); ++i) ids_.emplace(strings[i], static_cast<std::uint32_t>(i));
  }
  program::StringId id(std::string_view text) {
    const auto [at, is_new] = ids_.try_emplace(std::string(text), static_cast<std::uint32_t>(strings_.size()));
    if (is_new) strings_.push_back(at->first);
    return program::StringId{at->second};
  }

 private:
  std::vector<std::string>& strings_;
  std::unordered_map<std::string, std::uint32_t> ids_;
};

bool is_root(const program::Input& input) { return input.from == program::StringId{} && input.name == input.path; }

bool leads_to(const program::Program& program, const program::Input& input, const lang::Source* source) {
  return source != nullptr && program.string(input.path) == source->path() &&
         input.hash == program::text_hash(source->text());
}

}  // namespace

std::shared_ptr<const lang::Source> InputRecorder::find(std::string_view name, std::string_view from) {
  std::shared_ptr<const lang::Source> found = provider_.find(name, from);
  lookups_.push_back({std::string(name), std::string(from), found});
  return found;
}

void InputRecorder::note(const std::vector<std::shared_ptr<const lang::Source>>& roots, program::Draft& draft) const {
  // What led nowhere might be there tomorrow; a path that is no text cannot stand in a program.
  for (const auto& root : roots)
    if (!program::is_utf8(root->path())) return;
  for (const Lookup& l : lookups_)
    if (!l.found || l.name.empty() || !program::is_utf8(l.name) || !program::is_utf8(l.found->path())) return;

  Strings strings(draft.strings);
  const auto note = [&](std::string_view name, std::string_view from, std::string_view path, std::string_view text) {
    draft.inputs.push_back({strings.id(name), strings.id(from), strings.id(path), {}, program::text_hash(text)});
  };
  note(kCompiler, "", kVersion, kVersion);
  for (const auto& root : roots) note(root->path(), "", root->path(), root->text());
  for (const Lookup& l : lookups_) note(l.name, l.from, l.found->path(), l.found->text());
}

bool is_up_to_date(const program::Program& program, const std::vector<std::shared_ptr<const lang::Source>>& roots,
                   bool any_face, SourceFiles& sources) {
  const auto inputs = program.inputs;
  if (inputs.size() < 1 + roots.size()) return false;
  if (program.string(inputs[0].name) != kCompiler || program.string(inputs[0].path) != kVersion) return false;
  std::size_t next = 1;
  for (const auto& root : roots)
    if (!is_root(inputs[next]) || !leads_to(program, inputs[next++], root.get())) return false;
  if (any_face && next < inputs.size() && is_root(inputs[next]) &&
      program.string(inputs[next].path).starts_with(kFaces)) {
    const std::string name(program.string(inputs[next].path).substr(kLibrary.size()));
    if (!leads_to(program, inputs[next++], sources.stdlib(name).get())) return false;
  }
  for (; next < inputs.size(); ++next) {
    const auto found = sources.find(program.string(inputs[next].name), program.string(inputs[next].from));
    if (!leads_to(program, inputs[next], found.get())) return false;
  }
  return true;
}

std::string path_beside(const std::string& file) {
  constexpr std::string_view kSource = ".nms";
  if (!file.ends_with(kSource)) return {};
  return file.substr(0, file.size() - kSource.size()) + ".auc";
}

}  // namespace nms::cli
