#include "facs_string.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include <nms/compiler/diagnostic_kinds.h>

#include "movement.h"

namespace nms::compiler {
namespace {

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return upper(c) >= 'A' && upper(c) <= 'Z'; }
bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// A unit's text: `L20B`, `AU12`, `5*`.
class UnitReader {
 public:
  explicit UnitReader(std::string_view text) : text_(text) { unit_.text = text; }

  std::optional<FacsUnit> read() {
    if (text_.size() > 2 && upper(text_[0]) == 'A' && upper(text_[1]) == 'U') at_ = 2;
    if (at_ < text_.size() && is_letter(text_[at_]) && !in_front(upper(text_[at_++]))) return std::nullopt;
    if (!number()) return std::nullopt;
    for (; at_ < text_.size(); ++at_)
      if (!behind(upper(text_[at_]))) return std::nullopt;
    if (any_ && !letter_) unit_.unit.intensity = kAnyIntensity;
    return unit_;
  }

 private:
  bool side(char c) {
    if (unit_.unit.side != program::Side::none || (c != 'L' && c != 'R' && c != 'U')) return false;
    unit_.unit.side = c == 'L' ? program::Side::left : program::Side::right;
    return true;
  }

  bool in_front(char c) {
    if (c == 'T' || c == 'B') {
      unit_.lip = c == 'T' ? FacsUnit::Lip::upper : FacsUnit::Lip::lower;
      return true;
    }
    if (c == 'M') return unit_.movement = true;
    return side(c);
  }

  bool number() {
    const std::size_t first = at_;
    std::uint32_t number = 0;
    while (at_ < text_.size() && is_digit(text_[at_]) && at_ - first < 4)
      number = number * 10 + static_cast<std::uint32_t>(text_[at_++] - '0');
    unit_.unit.number = static_cast<std::uint16_t>(number);
    return at_ != first && number != 0 && number <= 999;
  }

  bool behind(char c) {
    if (any_) return false;
    if (c == '*') return any_ = true;
    if (unit_.movement) return false;
    if (c < 'A' || c > 'E' || letter_) return side(c);
    unit_.unit.intensity = (c - 'A' + 1) / 5.0;
    return letter_ = true;
  }

  std::string_view text_;
  FacsUnit unit_;
  std::size_t at_ = 0;
  bool letter_ = false;
  bool any_ = false;
};

class StringReader {
 public:
  explicit StringReader(std::string_view text) : text_(text) {}

  FacsString read() {
    blanks();
    if (at_ == text_.size()) return bad(text_, "has no unit");
    while (out_.reason.empty()) {
      combination();
      if (!out_.reason.empty() || at_ == text_.size()) break;
      if (text_[at_] != ',' && text_[at_] != ';') return bad(text_.substr(at_, 1), "is not what joins units");
      ++at_;
      blanks();
      static_cast<void>(or_word());  // "26, or 27"
      first_ = false;
    }
    return std::move(out_);
  }

 private:
  FacsString bad(std::string_view text, std::string_view reason) {
    out_.bad = text;
    out_.reason = reason;
    return std::move(out_);
  }
  void fail(std::string_view text, std::string_view reason) {
    out_.bad = text;
    out_.reason = reason;
  }

  void blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }
  [[nodiscard]] bool is_next(char c) const { return at_ < text_.size() && text_[at_] == c; }
  bool take(char c) {
    if (!is_next(c)) return false;
    ++at_;
    blanks();
    return true;
  }
  bool or_word() {
    const std::string_view rest = text_.substr(at_);
    if (rest.size() < 3 || upper(rest[0]) != 'O' || upper(rest[1]) != 'R' || is_digit(rest[2]) || is_letter(rest[2]))
      return false;
    at_ += 2;
    blanks();
    return true;
  }

  void combination() {
    do {
      if (take('(')) {
        const std::size_t open = at_ - 1;
        do choice();
        while (out_.reason.empty() && (take('+') || more()));
        if (!out_.reason.empty()) return;
        if (!take(')')) return fail(text_.substr(open), "has a bracket that is not closed");
      } else {
        choice();
      }
    } while (out_.reason.empty() && (take('+') || more() || is_next('(')));
  }
  /// Units with nothing but blanks between them: "1C 2C".
  [[nodiscard]] bool more() const { return at_ < text_.size() && (is_digit(text_[at_]) || is_letter(text_[at_])); }

  void choice() {
    bool chosen = first_;
    do {
      if (!letter_alone()) unit(chosen);
      chosen = false;
    } while (out_.reason.empty() && (take('/') || take('@') || or_word()));
  }

  /// The other intensity of the unit in front, "12C/D": passed over.
  bool letter_alone() {
    const bool lone = at_ != 0 && text_[at_ - 1] == '/' && at_ < text_.size() && upper(text_[at_]) >= 'A' &&
                      upper(text_[at_]) <= 'E' &&
                      (at_ + 1 == text_.size() || (!is_digit(text_[at_ + 1]) && !is_letter(text_[at_ + 1])));
    if (!lone) return false;
    ++at_;
    blanks();
    return true;
  }

  void unit(bool counts) {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (is_digit(text_[at_]) || is_letter(text_[at_]))) ++at_;
    if (is_next('*')) ++at_;
    const std::string_view text = text_.substr(begin, at_ - begin);
    if (text.empty()) return fail(text_.substr(begin, 1), "is no unit");
    const auto read = UnitReader(text).read();
    if (!read) return fail(text, "is no unit");
    (counts ? out_.units : out_.others).push_back(*read);
    blanks();
  }

  std::string_view text_;
  FacsString out_;
  std::size_t at_ = 0;
  bool first_ = true;  ///< of the combinations
};

}  // namespace

FacsString read_facs_string(std::string_view text) { return StringReader(text).read(); }

bool Evaluator::facs(lang::NodeRef node, const Scale& scale, const Scope& scope, Movement& into) {
  const lang::NodeRef string = node.child(lang::NodeKind::string);
  if (!string) return false;
  const std::string written = unquoted(string);
  const FacsString read = read_facs_string(written);
  if (!read.reason.empty()) {
    report(scope, string, BadFacsString{std::string(read.bad), std::string(read.reason)});
    return false;
  }
  bool good = true;
  Movement unplayed;  // an alternative that does not count has to be right all the same
  for (const FacsUnit& u : read.units) good = facs_unit(u, scale, string, scope, into) && good;
  for (const FacsUnit& u : read.others) good = facs_unit(u, scale, string, scope, unplayed) && good;
  return good;
}

bool Evaluator::facs_unit(const FacsUnit& u, const Scale& scale, lang::NodeRef at, const Scope& scope, Movement& into) {
  if (!u.movement) {
    if (!add_unit(u.text, u.unit.number, u.unit.side, u.unit.intensity, scale, at, scope, into.pose)) return false;
    if (u.lip != FacsUnit::Lip::both)
      report(scope, at,
             OneLip{std::string(u.text), fmt::format("AU{}", u.unit.number),
                    u.lip == FacsUnit::Lip::upper ? "upper" : "lower"});
    return true;
  }
  // The library says what a movement code does.
  const std::string name = fmt::format("facs_M{}", u.unit.number);
  const Declaration* d = declarations_.find_movement(name, scope.file);
  if (d == nullptr) {
    report(scope, at,
           BadFacsString{std::string(u.text), fmt::format("is no movement code of the library: there is no {}", name)});
    return false;
  }
  const auto inner = bind({}, false, d->name, declarations_.params(*d), d->file, scope);
  auto part = inner ? declaration(*d, *inner) : std::nullopt;
  return part && take(std::move(*part), scale, at, scope, into);
}

}  // namespace nms::compiler
