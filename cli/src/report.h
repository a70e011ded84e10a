#pragma once

#include <cstdio>

#include <nms/lang/diagnostic.h>
#include <nms/program/failure.h>

#include "commands.h"

namespace nms::cli {

/// A failure of the world among the diagnostics of the text: same fields, same printing.
void add_failure(lang::Diagnostics& diagnostics, const program::Failure& failure,
                 lang::Severity severity = lang::Severity::error);

/// Where a command says what it has made: stderr; stdout if stderr is for a program to read.
[[nodiscard]] std::FILE* told(const GlobalOptions& global);

/// Prints all diagnostics on stderr, in the format asked for; text in colour on a terminal. With none: nothing in text,
/// an empty list in JSON. Returns the exit code they mean.
int finish(const GlobalOptions& global, lang::Diagnostics& diagnostics);

}  // namespace nms::cli
