#include "vrml_read.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace nms::runtime {

namespace {

using program::Failure;
using Maybe = std::optional<Failure>;

constexpr int kMaxDepth = 128;
constexpr std::size_t kMaxNodes = 200'000;

enum class Tok { end, word, number, string, open, close, open_list, close_list };

struct Token {
  Tok kind = Tok::end;
  std::string_view text;  // of a string: what is between its quotes, escapes untouched
  std::size_t line = 1;
};

/// Words, numbers, strings and brackets; commas are blanks, # comments out the rest of a line.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : text_(text) { next(); }

  [[nodiscard]] const Token& at() const { return token_; }
  [[nodiscard]] bool at(Tok kind) const { return token_.kind == kind; }
  [[nodiscard]] bool at_word(std::string_view word) const { return token_.kind == Tok::word && token_.text == word; }

  Token take() {
    const Token taken = token_;
    next();
    return taken;
  }

 private:
  static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == '\0' || c == '\f' || c == '\v';
  }
  static bool ends_word(char c) {
    return is_blank(c) || c == '"' || c == '#' || c == '{' || c == '}' || c == '[' || c == ']';
  }

  void skip_blanks() {
    while (i_ < text_.size()) {
      if (text_[i_] == '#') {
        while (i_ < text_.size() && text_[i_] != '\n') ++i_;
      } else if (is_blank(text_[i_])) {
        line_ += text_[i_] == '\n' ? 1 : 0;
        ++i_;
      } else {
        return;
      }
    }
  }

  void next() {
    skip_blanks();
    token_ = {Tok::end, {}, line_};
    if (i_ >= text_.size()) return;
    const char c = text_[i_];
    const auto single = [&](Tok kind) {
      token_.kind = kind;
      token_.text = text_.substr(i_++, 1);
    };
    if (c == '{') return single(Tok::open);
    if (c == '}') return single(Tok::close);
    if (c == '[') return single(Tok::open_list);
    if (c == ']') return single(Tok::close_list);
    if (c == '"') {
      const std::size_t begin = ++i_;
      while (i_ < text_.size() && text_[i_] != '"') {
        if (text_[i_] == '\\') ++i_;
        if (i_ < text_.size()) line_ += text_[i_] == '\n' ? 1 : 0;
        ++i_;
      }
      const std::size_t end = std::min(i_, text_.size());
      token_.kind = Tok::string;
      token_.text = text_.substr(begin, end - begin);
      i_ = std::min(end + 1, text_.size());
      return;
    }
    const std::size_t begin = i_;
    while (i_ < text_.size() && !ends_word(text_[i_])) ++i_;
    token_.text = text_.substr(begin, i_ - begin);
    const bool digit = c >= '0' && c <= '9';
    token_.kind = digit || c == '-' || c == '+' || c == '.' ? Tok::number : Tok::word;
  }

  std::string_view text_;
  std::size_t i_ = 0;
  std::size_t line_ = 1;
  Token token_;
};

class VrmlReader {
 public:
  VrmlReader(std::string_view text, std::string_view name, pugi::xml_document& document)
      : tokens_(text), name_(name), document_(document) {}

  Maybe run() {
    pugi::xml_node root = document_.append_child("X3D");
    head_ = root.append_child("head");
    pugi::xml_node scene = root.append_child("Scene");
    while (!tokens_.at(Tok::end)) {
      if (auto failure = statement(scene, "children", 0)) return failure;
    }
    return std::nullopt;
  }

 private:
  Failure wrong(const Token& at, std::string cause) const {
    return {"face_not_vrml", fmt::format("{}:{}", name_, at.line), std::move(cause),
            "save the face as VRML97, or as X3D in its XML or Classic VRML form"};
  }
  Failure wrong_here(std::string_view wanted) const {
    const Token& t = tokens_.at();
    if (t.kind == Tok::end) return wrong(t, fmt::format("the file ends where {} should stand", wanted));
    return wrong(t, fmt::format("\"{}\" stands where {} should", t.text.substr(0, 40), wanted));
  }

  /// What stands between nodes.
  Maybe statement(pugi::xml_node parent, std::string_view field, int depth) {
    if (!tokens_.at(Tok::word)) return wrong_here("a node");
    const std::string_view word = tokens_.at().text;
    if (word == "PROTO" || word == "EXTERNPROTO") return prototype();
    if (word == "ROUTE") return skip_words(4);
    if (word == "PROFILE" || word == "COMPONENT" || word == "EXPORT") return skip_line();
    if (word == "META" || word == "IMPORT") return skip_line();
    if (word == "UNIT") return unit();
    return node(parent, field, depth);
  }

  Maybe skip_words(int count) {
    for (int i = 0; i < count; ++i) {
      if (!tokens_.at(Tok::word)) return wrong_here("a name");
      tokens_.take();
    }
    return std::nullopt;
  }

  // PROFILE and its like say no end: all that stands on their line belongs to them.
  Maybe skip_line() {
    const std::size_t line = tokens_.at().line;
    while (!tokens_.at(Tok::end) && tokens_.at().line == line) tokens_.take();
    return std::nullopt;
  }

  Maybe unit() {
    tokens_.take();
    const Token category = tokens_.take();
    const Token title = tokens_.take();
    const Token factor = tokens_.take();
    if (category.kind != Tok::word || title.kind != Tok::word || factor.kind != Tok::number)
      return wrong(category, "UNIT is followed by a category, a name and a number");
    pugi::xml_node u = head_.append_child("unit");
    set(u, "category", category.text);
    set(u, "conversionFactor", factor.text);
    return std::nullopt;
  }

  Maybe prototype() {
    const bool body = tokens_.take().text == "PROTO";
    if (!tokens_.at(Tok::word)) return wrong_here("the prototype's name");
    tokens_.take();
    if (!tokens_.at(Tok::open_list)) return wrong_here("[");
    if (auto failure = skip_balanced()) return failure;
    if (body) return tokens_.at(Tok::open) ? skip_balanced() : wrong_here("{");
    if (tokens_.at(Tok::open_list)) return skip_balanced();
    while (tokens_.at(Tok::string)) tokens_.take();
    return std::nullopt;
  }

  /// From an opening bracket to its closing one.
  Maybe skip_balanced() {
    const Token opener = tokens_.at();
    std::string closers;
    do {
      const Token t = tokens_.take();
      if (t.kind == Tok::open) closers += '}';
      if (t.kind == Tok::open_list) closers += ']';
      if (t.kind == Tok::close || t.kind == Tok::close_list) {
        if (closers.back() != t.text.front()) return wrong(t, fmt::format("\"{}\" closes nothing", t.text));
        closers.pop_back();
      }
      if (t.kind == Tok::end) return wrong(opener, fmt::format("this {} is never closed", opener.text));
    } while (!closers.empty());
    return std::nullopt;
  }

  static void set(pugi::xml_node node, const char* key, std::string_view value) {
    node.append_attribute(key).set_value(std::string(value).c_str());
  }

  Maybe node(pugi::xml_node parent, std::string_view field, int depth) {
    if (depth > kMaxDepth) return wrong(tokens_.at(), "nodes are nested too deep");
    if (++nodes_ > kMaxNodes) return wrong(tokens_.at(), fmt::format("there are more than {} nodes", kMaxNodes));
    std::string_view def;
    if (tokens_.at_word("USE")) {
      tokens_.take();
      if (!tokens_.at(Tok::word)) return wrong_here("the name of a node");
      return use(parent, field, tokens_.take());
    }
    if (tokens_.at_word("DEF")) {
      tokens_.take();
      if (!tokens_.at(Tok::word) && !tokens_.at(Tok::number)) return wrong_here("the node's name");
      def = tokens_.take().text;
    }
    if (!tokens_.at(Tok::word)) return wrong_here("a kind of node");
    const Token kind = tokens_.take();
    if (!tokens_.at(Tok::open)) return wrong_here("{");
    if (kind.text == "Script" || kind.text.find("Shader") != std::string_view::npos) return skip_balanced();
    tokens_.take();
    const std::string name(kind.text == "NurbsSurface" ? std::string_view("NurbsPatchSurface") : kind.text);
    pugi::xml_node made = parent.append_child(name.c_str());
    if (!def.empty()) {
      set(made, "DEF", def);
      defined_.emplace_back(def, name);
    }
    set(made, "containerField", field);
    set(made, kVrmlLine, fmt::format("{}", kind.line));
    while (!tokens_.at(Tok::close)) {
      if (auto failure = field_of(made, depth)) return failure;
    }
    tokens_.take();
    return std::nullopt;
  }

  // An element that uses another has its kind. Of two nodes with one name the last before counts.
  Maybe use(pugi::xml_node parent, std::string_view field, const Token& target) {
    const auto found =
        std::find_if(defined_.rbegin(), defined_.rend(), [&](const auto& d) { return d.first == target.text; });
    if (found == defined_.rend()) return std::nullopt;  // a node that was skipped
    pugi::xml_node made = parent.append_child(found->second.c_str());
    set(made, "USE", target.text);
    set(made, "containerField", field);
    return std::nullopt;
  }

  Maybe field_of(pugi::xml_node owner, int depth) {
    if (tokens_.at_word("PROTO") || tokens_.at_word("EXTERNPROTO") || tokens_.at_word("ROUTE"))
      return statement(owner, "children", depth + 1);
    if (!tokens_.at(Tok::word)) return wrong_here("a field, or }");
    const std::string field(tokens_.take().text);
    if (tokens_.at_word("IS")) return skip_words(2);
    if (tokens_.at(Tok::open_list)) {
      tokens_.take();
      if (tokens_.at(Tok::number) || tokens_.at(Tok::string)) {
        if (auto failure = plain(owner, field)) return failure;
      } else {
        while (tokens_.at(Tok::word)) {
          if (tokens_.at_word("TRUE") || tokens_.at_word("FALSE")) {
            tokens_.take();
          } else if (auto failure = statement(owner, field, depth + 1)) {
            return failure;
          }
        }
      }
      if (!tokens_.at(Tok::close_list)) return wrong_here("]");
      tokens_.take();
      return std::nullopt;
    }
    if (tokens_.at(Tok::number) || tokens_.at(Tok::string)) return plain(owner, field);
    if (!tokens_.at(Tok::word)) return wrong_here("a value");
    if (tokens_.at_word("TRUE") || tokens_.at_word("FALSE")) {
      set(owner, field.c_str(), tokens_.take().text == "TRUE" ? "true" : "false");
      return std::nullopt;
    }
    if (tokens_.at_word("NULL")) {
      tokens_.take();
      return std::nullopt;
    }
    return node(owner, field, depth + 1);
  }

  /// Numbers or strings, as one attribute. VRML97's surfaces hold their control points so.
  Maybe plain(pugi::xml_node owner, const std::string& field) {
    std::string text;
    const Tok kind = tokens_.at().kind;
    while (tokens_.at(kind)) {
      if (!text.empty()) text += ' ';
      const Token t = tokens_.take();
      if (kind == Tok::string)
        text += fmt::format("\"{}\"", t.text);
      else
        text += t.text;
    }
    if (field == "controlPoint" && kind == Tok::number) {
      pugi::xml_node points = owner.append_child("Coordinate");
      set(points, "containerField", field);
      set(points, "point", text);
      return std::nullopt;
    }
    // Metadata's names are single strings; the scene reads them without quotes.
    if (kind == Tok::string && field != "value") text = text.substr(1, text.size() - 2);
    set(owner, field.c_str(), text);
    return std::nullopt;
  }

  Tokens tokens_;
  std::string_view name_;
  pugi::xml_document& document_;
  pugi::xml_node head_;
  std::size_t nodes_ = 0;
  std::vector<std::pair<std::string_view, std::string>> defined_;
};

}  // namespace

std::optional<Failure> read_vrml(std::string_view text, std::string_view name, pugi::xml_document& document) {
  return VrmlReader(text, name, document).run();
}

}  // namespace nms::runtime
