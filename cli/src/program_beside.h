#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/source.h>
#include <nms/program/program.h>

#include "loaded_program.h"
#include "source_files.h"

/// A program compiled earlier stands for its text as long as the text is what it was.
///
/// A program notes what was read for it: the compiler and its version, the files named on the command line, then every
/// name looked up after `use`, with the path it led to and a hash of the text there. Looking the same names up again
/// and hashing again tells whether a compiler would see the same; no clock is asked and nothing is parsed.
namespace nms::cli {

/// Hands on to another provider and notes what was looked up.
class InputRecorder : public lang::SourceProvider {
 public:
  explicit InputRecorder(lang::SourceProvider& provider) : provider_(provider) {}
  [[nodiscard]] std::shared_ptr<const lang::Source> find(std::string_view name, std::string_view from) override;

  /// Fills in the draft's inputs. With a name that led nowhere there are none: a program that might be another
  /// tomorrow is not noted as up to date.
  void note(const std::vector<std::shared_ptr<const lang::Source>>& roots, program::Draft& draft) const;

 private:
  struct Lookup {
    std::string name;
    std::string from;
    std::shared_ptr<const lang::Source> found;
  };
  lang::SourceProvider& provider_;
  std::vector<Lookup> lookups_;
};

/// Whether this very nmsc would make the program of these roots.
/// @param any_face  a face of the standard library among the program's roots, behind the others, is no matter
[[nodiscard]] bool is_up_to_date(const program::Program& program,
                                 const std::vector<std::shared_ptr<const lang::Source>>& roots, bool any_face,
                                 SourceFiles& sources);

/// "x.auc" for "x.nms"; empty for what is no source's path.
[[nodiscard]] std::string path_beside(const std::string& file);

}  // namespace nms::cli
