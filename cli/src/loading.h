#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nms/compiler/time_table.h>
#include <nms/compiler/tree_cache.h>
#include <nms/lang/diagnostic.h>
#include <nms/program/program.h>
#include <nms/runtime/face.h>
#include <nms/runtime/rig.h>

#include "commands.h"
#include "loaded_program.h"
#include "source_files.h"

namespace nms::cli {

/// The sources that the user named, each once. A compiled program is none: it is refused here.
[[nodiscard]] std::vector<std::shared_ptr<const lang::Source>> load_roots(const std::vector<std::string>& files,
                                                                          SourceFiles& sources,
                                                                          lang::Diagnostics& diagnostics);

/// The program that was compiled, checked as one from outside is. Nothing: a defect of ours, which is reported.
[[nodiscard]] std::optional<program::Image> checked_image(const program::Draft& draft, lang::Diagnostics& diagnostics);

/// The tables of times that the user named with --marks. Nothing: `diagnostics` says why.
[[nodiscard]] std::optional<std::vector<compiler::TimeTable>> load_time_tables(const GlobalOptions& global,
                                                                               SourceFiles& sources,
                                                                               lang::Diagnostics& diagnostics);

/// What a compiled program beside its source, x.auc for x.nms, has to do with the matter.
enum class Reuse {
  none,
  note_inputs,     ///< compile, and note in the program what was read, so that it can stand for its source
  program_beside,  ///< use it, if it is what compiling the source would make; a damaged one is warned of
};

/// A program from files: `.nms` sources are compiled together, with the tables of times that go with them; a single
/// `.auc` is mapped and checked.
/// @param face  the face whose rig description is wanted too; empty: none
/// Nothing: `diagnostics` says why.
[[nodiscard]] std::optional<LoadedProgram> load_program(const GlobalOptions& global,
                                                        const std::vector<std::string>& files, const std::string& face,
                                                        SourceFiles& sources, lang::Diagnostics& diagnostics,
                                                        Reuse reuse = Reuse::none);

/// Says what `load_program` would have to say of these files, and makes no program of sources.
void check_files(const GlobalOptions& global, const std::vector<std::string>& files, SourceFiles& sources,
                 lang::Diagnostics& diagnostics);

/// A program of one lexicon's entries, inherited ones included, with a face's rig description.
/// @param file   that declares it
/// @param trees  of files that were parsed already
[[nodiscard]] std::optional<program::Image> load_lexicon_program(const GlobalOptions& global, const std::string& file,
                                                                 const std::string& lexicon, const std::string& face,
                                                                 SourceFiles& sources, lang::Diagnostics& diagnostics,
                                                                 compiler::TreeCache& trees);

/// The file that declares a face: a path to one, or a name in the standard library. Null: there is none.
[[nodiscard]] std::shared_ptr<const lang::Source> face_source(const std::string& face, SourceFiles& sources);

/// The file that holds the surface of a program's face.
[[nodiscard]] std::shared_ptr<const lang::Source> face_surface(const program::Program& program, const std::string& face,
                                                               SourceFiles& sources, lang::Diagnostics& diagnostics);

[[nodiscard]] std::optional<runtime::Face> read_face(const program::Program& program, const lang::Source& surface,
                                                     lang::Diagnostics& diagnostics);

/// The face bound to the program's rig description. What it lacks a place for is warned of, and does nothing.
[[nodiscard]] std::optional<runtime::Rig> bind_face(const runtime::Face& face, const program::Program& program,
                                                    lang::Diagnostics& diagnostics);

/// Surface and geometry: the face that a program's rig description names: its geometry.
[[nodiscard]] std::optional<runtime::Face> load_face(const program::Program& program, const std::string& face,
                                                     SourceFiles& sources, lang::Diagnostics& diagnostics);

/// The clip of that name; if there is none, says which there are.
[[nodiscard]] const program::Clip* find_clip(const program::Program& program, const std::string& name,
                                             const std::string& file, lang::Diagnostics& diagnostics);

}  // namespace nms::cli
