#include <nms/lang/diagnostic_kinds.h>

#include <fmt/format.h>

namespace nms::lang {
namespace {

// "`a`", "`a` or `b`"
std::string listed(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i)
    out += fmt::format("{}`{}`", i == 0 ? "" : (i + 1 == names.size() ? " or " : ", "), names[i]);
  return out;
}

std::string joined(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& n : names) out += (out.empty() ? "" : " ") + n;
  return out;
}

char closer_of(char opener) { return opener == '(' ? ')' : opener == '[' ? ']' : '}'; }

}  // namespace

Description UnexpectedToken::describe() const {
  Description d{fmt::format("saw {}, expected {}", seen, expected), {}, {{"seen", seen}, {"expected", expected}}};
  if (!help.empty()) d.helps.push_back(help);
  return d;
}

Description MissingTerminator::describe() const {
  return {fmt::format("saw {} where the statement should end", seen),
          {help.empty() ? "begin a new line, or write `;` between two statements" : help},
          {{"seen", seen}}};
}

Description UnknownDeclaration::describe() const {
  Description d{fmt::format("`{}` does not begin a declaration", word), {}, {{"word", word}}};
  if (nearest.empty()) {
    d.helps.emplace_back(
        "a file holds: use, pose, expression, motion, timeline, lexicon, utterance, discourse, test, au, axis, track, "
        "muscle, face");
  } else {
    d.helps.push_back(fmt::format("did you mean {}?", listed(nearest)));
    d.fields.push_back({"nearest", joined(nearest)});
  }
  return d;
}

Description UnclosedBracket::describe() const {
  return {fmt::format("saw {} before the `{}` was closed", seen, opener),
          {fmt::format("write the missing `{}`", closer_of(opener))},
          {{"opener", std::string(1, opener)}, {"seen", seen}}};
}

Description DetachedBracket::describe() const {
  if (label.empty())
    return {"this `[` has no label", {"write the label of the brackets first, as `wh[ WHO ]`"}, {{"label", ""}}};
  return {fmt::format("a blank parts the label `{}` from its `[`", label),
          {fmt::format("write `{}[`", label)},
          {{"label", label}}};
}

Description UnterminatedString::describe() const {
  return {"the line ends inside a string", {"write `\"` where the string ends"}, {}};
}

Description UnterminatedGloss::describe() const {
  return {"the line ends inside a backquoted gloss", {"write a backquote where the gloss ends"}, {}};
}

Description EmptyGloss::describe() const {
  return {fmt::format("saw {}, expected a sign's gloss", seen),
          {"a gloss is a run without blanks, as `BOOK` or `IX-3p:t`; write backquotes around any other"},
          {{"seen", seen}}};
}

Description BadSignTime::describe() const {
  return {fmt::format("the time of `{}` has {}, expected {}", gloss, seen, expected),
          {fmt::format("a sign's time is start..end, with ~ for how long it is held: `{}@0.40s..0.82s~1.10s`", gloss)},
          {{"gloss", gloss}, {"seen", seen}, {"expected", expected}}};
}

Description BadQuantity::describe() const {
  Description d{fmt::format("`{}` {}", text, why), {}, {{"text", text}}};
  if (!help.empty()) d.helps.push_back(help);
  return d;
}

Description UnknownUnit::describe() const {
  Description d{fmt::format("`{}` is not a unit", unit), {}, {{"number", number}, {"unit", unit}}};
  if (!nearest.empty()) {
    d.helps.push_back(fmt::format("did you mean `{}{}`?", number, nearest.front()));
    d.fields.push_back({"nearest", joined(nearest)});
  }
  d.helps.emplace_back("the units are %, s, ms, us, deg, Hz, x, mm, cm");
  return d;
}

Description InvalidCharacter::describe() const {
  std::string shown;
  std::string code;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(text[i])); };
  const unsigned first = text.empty() ? 0U : byte(0);
  // One character's worth of UTF-8 is shown; anything else by its byte.
  std::size_t length = first < 0x80 ? 1 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : first >= 0xC2 ? 2 : 0;
  unsigned point = length == 4 ? first & 0x07U : length == 3 ? first & 0x0FU : length == 2 ? first & 0x1FU : first;
  if (length > text.size()) length = 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) {
      length = 0;
      break;
    }
    point = point << 6U | (byte(i) & 0x3FU);
  }
  if (length == 0) {
    shown = fmt::format("the byte 0x{:02X}, which is not UTF-8,", first);
    code = fmt::format("0x{:02X}", first);
  } else {
    code = fmt::format("U+{:04X}", point);
    shown = point < 32 || point == 127 ? fmt::format("the control character {}", code)
                                       : fmt::format("`{}`", text.substr(0, length));
  }
  Description d{fmt::format("{} has no meaning here", shown), {}, {{"character", code}}};
  if (length != 0 && point >= 128)
    d.helps.emplace_back("names are of ASCII letters, digits and `_`; other characters belong in strings and glosses");
  else if (point == '#')
    d.helps.emplace_back("a comment begins with `//`");
  else if (point == '/')
    d.helps.emplace_back("a comment begins with `//`; a share is written `50%`, not as a division");
  else if (point == '\'')
    d.helps.emplace_back("strings stand in double quotes");
  else if (point == '%')
    d.helps.emplace_back("`%` follows its number without a blank: `60%`");
  return d;
}

Description DuplicateProperty::describe() const {
  return {fmt::format("`{}` is said twice", name), {"keep one of the two"}, {{"name", name}}};
}

Description NestingTooDeep::describe() const {
  return {fmt::format("brackets nest deeper than {}", limit),
          {"give the inner part a name of its own, and use that"},
          {{"limit", fmt::format("{}", limit)}}};
}

Description FileTooLarge::describe() const {
  return {fmt::format("the file has {} bytes; at most {} are read", bytes, limit),
          {"split it, and `use` the parts"},
          {{"bytes", fmt::format("{}", bytes)}, {"limit", fmt::format("{}", limit)}}};
}

}  // namespace nms::lang
