#include "json_text.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace nms::runtime {
namespace {

std::size_t past_blanks(std::string_view text, std::size_t at) {
  while (at < text.size() && (text[at] == ' ' || text[at] == '\t' || text[at] == '\n' || text[at] == '\r')) ++at;
  return at;
}

/// Behind the closing quote of the string that begins at `at`.
std::size_t past_string(std::string_view text, std::size_t at) {
  for (++at; at < text.size() && text[at] != '"'; ++at)
    if (text[at] == '\\') ++at;
  return std::min(at + 1, text.size());
}

bool opens(char c) { return c == '{' || c == '['; }
bool closes(char c) { return c == '}' || c == ']'; }

/// The values between the brackets of `container`, with the blanks about each left out.
template <typename Each>
void each_value(std::string_view text, TextSpan container, char open, const Each& each) {
  if (container.empty() || text[container.begin] != open) return;
  for (std::size_t at = past_blanks(text, container.begin + 1); at + 1 < container.end;) {
    at = past_blanks(text, each(at));
    if (at < container.end && text[at] == ',') at = past_blanks(text, at + 1);
  }
}

/// Whether a key as it is written, escapes and all, is that one.
bool spells(std::string_view written, std::string_view key) {
  if (written.find('\\') == std::string_view::npos) return written == key;
  const auto read = nlohmann::json::parse('"' + std::string(written) + '"', nullptr, false);
  return read.is_string() && read.get_ref<const std::string&>() == key;
}

}  // namespace

TextSpan json_value(std::string_view text, std::size_t at) {
  if (at == 0 && text.starts_with("\xEF\xBB\xBF")) at = 3;
  const std::size_t begin = at = past_blanks(text, at);
  if (begin >= text.size()) return {text.size(), text.size()};
  if (text[begin] == '"') return {begin, past_string(text, begin)};
  if (!opens(text[begin])) {  // a number or a word
    while (at < text.size() && !closes(text[at]) && text[at] != ',' && text[at] != ':' && past_blanks(text, at) == at)
      ++at;
    return {begin, std::max(at, begin + 1)};
  }
  std::size_t depth = 0;
  while (at < text.size()) {
    const char c = text[at];
    at = c == '"' ? past_string(text, at) : at + 1;
    if (opens(c)) ++depth;
    if (closes(c) && --depth == 0) break;
  }
  return {begin, at};
}

std::vector<JsonMember> json_members(std::string_view text, TextSpan object) {
  std::vector<JsonMember> members;
  each_value(text, object, '{', [&](std::size_t at) {
    const std::size_t key_end = json_value(text, at).end;
    const TextSpan value = json_value(text, past_blanks(text, key_end) + 1);  // behind the colon
    members.push_back({{at + 1, std::max(key_end, at + 2) - 1}, value});
    return std::max(value.end, at + 1);
  });
  return members;
}

std::vector<TextSpan> json_elements(std::string_view text, TextSpan array) {
  std::vector<TextSpan> elements;
  each_value(text, array, '[', [&](std::size_t at) {
    elements.push_back(json_value(text, at));
    return std::max(elements.back().end, at + 1);
  });
  return elements;
}

TextSpan json_member(std::string_view text, TextSpan object, std::string_view key) {
  TextSpan found;
  for (const JsonMember& m : json_members(text, object))
    if (spells(m.key.of(text), key)) found = m.value;
  return found;
}

void JsonEdit::replace(TextSpan span, std::string by) { changes_.push_back({span, std::move(by)}); }

void JsonEdit::append(TextSpan container, const std::vector<std::string>& elements) {
  const std::size_t closing = container.end - 1;
  std::size_t last = closing;
  while (last > container.begin + 1 && past_blanks(text_, last - 1) != last - 1) --last;
  bool empty = last == container.begin + 1;
  std::string added;
  for (const std::string& e : elements) {
    if (!empty) added += ',';
    added += e;
    empty = false;
  }
  replace({last, last}, std::move(added));
}

std::string JsonEdit::done() {
  std::stable_sort(changes_.begin(), changes_.end(),
                   [](const Change& a, const Change& b) { return a.span.begin < b.span.begin; });
  std::string out;
  std::size_t at = root_.begin;
  for (const Change& c : changes_) {
    out += text_.substr(at, c.span.begin - at);
    out += c.by;
    at = c.span.end;
  }
  return out += text_.substr(at, root_.end - at);
}

}  // namespace nms::runtime
