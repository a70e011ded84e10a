#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nms::cli {

/// What becomes of a warning.
enum class Verdict { shown, denied, left_out };

/// What `--deny` and `--allow` say of a kind of warning. The nearer wins: the kind itself, its group, all warnings; of
/// two that are as near, `--deny`.
[[nodiscard]] Verdict verdict_on(std::string_view kind, const std::vector<std::string>& denied,
                                 const std::vector<std::string>& allowed);

/// Why a word is none that --deny or --allow take; empty: it is one. `warnings` means all.
[[nodiscard]] std::string wrong_warning_name(const std::string& word, bool all_may_be_meant);

}  // namespace nms::cli
