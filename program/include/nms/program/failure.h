#pragma once

#include <string>

namespace nms::program {

/// Why something from outside was refused: the world failed, not us and not the author's text.
///
/// `kind` is stable and meant for programs ("truncated_program"); the other three are for people, lower case:
/// where it was seen, what was seen, and what to do about it.
struct Failure {
  std::string kind;
  std::string place;
  std::string cause;
  std::string remedy;
};

}  // namespace nms::program
