// Canonical text: a walk over the tree that writes every node in its one form, and puts the comments back between.
//
//  - One statement a line, two spaces of indent, blank lines kept but never two.
//  - A block that its author wrote on one line stays there if it fits and holds one statement, or properties only. So
//  do
//    options, steps and signs.
//  - A sum too long for its line is broken after an operator, which is where the language lets a line end.
//  - A comment in the middle of a statement stays where a line may end; elsewhere it moves to the statement's end.
#include <algorithm>
#include <utility>
#include <vector>

#include <nms/lang/parse.h>

#include "format.h"
#include "format_lines.h"

namespace nms::lang {
namespace {

class Formatter : private FormatLines {
 public:
  explicit Formatter(const Tree& tree) : FormatLines(tree) {}

  FormattedText run() {
    bool first = true;
    std::size_t last = kNoStatement;
    for (NodeRef d : tree_.root().children()) {
      next_line(d.node().begin, first, false, last);
      first = false;
      last = begin_statement(d);
      statement(d);
    }
    next_line(static_cast<std::uint32_t>(text_.size()), first, true, last);
    if (!out_.empty() && out_.back() != '\n') out_ += '\n';
    return {std::move(out_), std::move(statements_)};
  }

 private:
  using Nodes = std::vector<NodeRef>;

  // ---- shared pieces
  void leaf(NodeRef n) {
    comments_before_token(n.node().begin);
    put(n.text());
  }
  void words(NodeRef n) {
    comments_before_token(n.node().begin);
    std::string_view t = n.text();
    bool first = true;
    while (true) {
      const std::size_t begin = t.find_first_not_of(kBlanks);
      if (begin == std::string_view::npos) return;
      t.remove_prefix(begin);
      const std::size_t end = std::min(t.find_first_of(kBlanks), t.size());
      if (!first) put(" ");
      put(t.substr(0, end));
      first = false;
      t.remove_prefix(end);
    }
  }
  [[nodiscard]] bool one_line(std::uint32_t begin, std::uint32_t end) const {
    return text_.substr(begin, end - begin).find('\n') == std::string_view::npos;
  }

  enum class Between : std::uint8_t { semicolons, blanks, properties };

  [[nodiscard]] static bool plain(NodeRef n) {
    return n.kind() == NodeKind::property || n.kind() == NodeKind::profile || n.kind() == NodeKind::combine_rule;
  }

  void separator(const Nodes& items, std::size_t i, Between between) {
    if (i == 0) return;
    if (between == Between::semicolons) return put("; ");
    if (between == Between::properties) {
      // Where the next one would be read as a value of the one before.
      const NodeRef before = items[i - 1];
      const NodeRef name = before.at(0);
      const bool bare = before.kind() == NodeKind::property && !before.at(1) && name.text() != "held";
      const NodeRef next = items[i].at(0);
      const bool number = items[i].kind() == NodeKind::property && next.is(NodeKind::quantity);
      if (bare || number) return put("; ");
    }
    put("  ");
  }

  // `open` items `close`, on one line if `may_flat` and they fit, else one a line.
  void items(const Nodes& list, std::string_view open, std::string_view close, std::uint32_t close_at, bool may_flat,
             Between between) {
    may_flat = may_flat && !comment_before(close_at);
    if (list.empty() && !comment_before(close_at)) {
      put(open);
      put(" ");
      put(close);
      last_end_ = close_at + 1;
      return;
    }
    const auto flat = [&] {
      put(open);
      put(" ");
      for (std::size_t i = 0; i < list.size() && !over_; ++i) {
        separator(list, i, between);
        statement(list[i]);
      }
      put(" ");
      put(close);
    };
    if (flat_ > 0) {
      flat();
      return;
    }
    if (may_flat && try_flat(flat)) {
      last_end_ = close_at + 1;
      return;
    }
    put(open);
    ++indent_;
    const int brackets = std::exchange(brackets_, 0);
    last_end_ = list.empty() ? close_at : list.front().node().begin;
    bool first = true;
    std::size_t last = kNoStatement;
    for (NodeRef n : list) {
      // Signs of one line stay together as far as they fit.
      const bool together = between == Between::blanks && !first && !comment_before(n.node().begin) &&
                            one_line(last_end_, n.node().begin) && try_flat([&] {
                              put("  ");
                              statement(n);
                            });
      if (together) {
        last_end_ = n.node().end;
        continue;
      }
      next_line(n.node().begin, first, false, last);
      first = false;
      if (between == Between::semicolons) last = begin_statement(n);
      statement(n);
    }
    next_line(close_at, first, true, last);
    brackets_ = brackets;
    --indent_;
    line_break(indent_);
    put(close);
    last_end_ = close_at + 1;
  }

  // The ` { ... }` of a node, whose last byte is its `}`.
  void block(NodeRef n, const Nodes& list, std::uint32_t header_end) {
    bool all_plain = true;
    for (NodeRef i : list) all_plain = all_plain && plain(i);
    put(" ");
    items(list, "{", "}", n.node().end - 1, (list.size() <= 1 || all_plain) && one_line(header_end, n.node().end),
          Between::semicolons);
  }

  // Header parts and items of a declaration, told apart by whether they stand before its `{`.
  void head(NodeRef n, Nodes& header, Nodes& body) const {
    bool in_body = false;
    std::uint32_t last = n.node().begin;
    for (NodeRef c : n.children()) {
      if (c.kind() == NodeKind::doc_comment) {
        last = c.node().end;
        continue;
      }
      if (!in_body && !header.empty())
        in_body = text_.substr(last, c.node().begin - last).find('{') != std::string_view::npos;
      (in_body ? body : header).push_back(c);
      last = c.node().end;
    }
  }
  static std::uint32_t end_of(const Nodes& header, NodeRef n) {
    return header.empty() ? n.node().begin : header.back().node().end;
  }

  // ---- statements
  void statement(NodeRef n) {
    if (over_) return;
    for (NodeRef c : n.children()) {
      if (c.kind() != NodeKind::doc_comment) break;
      if (flat_ > 0) over_ = true;
      put(c.text().empty() ? "///" : "/// ");
      put(c.text());
      line_break(indent_);
    }
    node(n);
    if (flat_ == 0) last_end_ = n.node().end;
  }

  void headed(NodeRef n, std::string_view word) {
    Nodes header;
    Nodes body;
    head(n, header, body);
    put(word);
    for (NodeRef h : header) {
      switch (h.kind()) {
        case NodeKind::params:
          node(h);
          break;
        case NodeKind::function:
        case NodeKind::muscle_kind:
          put(" : ");
          leaf(h);
          break;
        case NodeKind::au_token:
          put(h == n.child(NodeKind::au_token) ? " = " : " - ");
          leaf(h);
          break;
        default:
          put(" ");
          node(h);
      }
    }
    block(n, body, end_of(header, n));
  }

  void list(NodeRef n, std::string_view between, NodeKind only) {
    bool first = true;
    for (NodeRef c : n.children()) {
      if (over_) return;
      if (c.kind() != only) continue;
      if (!first) put(between);
      first = false;
      node(c);
    }
  }
  void in_parens(NodeRef n, NodeKind only) {
    put("(");
    ++brackets_;
    list(n, ", ", only);
    put_closing(n, ")");
  }
  void put_closing(NodeRef n, std::string_view closer) {
    if (n.node().end > 0 && text_[n.node().end - 1] == closer.front()) comments_before_token(n.node().end - 1);
    --brackets_;
    put(closer);
  }

  void node(NodeRef n) {
    if (over_) return;
    switch (n.kind()) {
      case NodeKind::file:
      case NodeKind::error:
      case NodeKind::doc_comment:
        return;
      case NodeKind::use:
        put("use ");
        return node(n.child(NodeKind::string));
      case NodeKind::pose:
      case NodeKind::motion:
        put(n.kind() == NodeKind::pose ? "pose " : "motion ");
        node(n.child(NodeKind::name));
        if (NodeRef p = n.child(NodeKind::params)) node(p);
        put(" = ");
        if (NodeRef s = n.child(NodeKind::steps)) return node(s);
        return node(n.child(NodeKind::sum));
      case NodeKind::expression:
      case NodeKind::timeline:
      case NodeKind::lexicon:
      case NodeKind::entry:
      case NodeKind::utterance:
      case NodeKind::discourse:
      case NodeKind::test:
      case NodeKind::au:
      case NodeKind::axis:
      case NodeKind::track:
      case NodeKind::muscle:
      case NodeKind::face:
      case NodeKind::by:
      case NodeKind::ambient:
        return headed(n, identifier(n.kind()));
      case NodeKind::extends:
      case NodeKind::in:
        put(identifier(n.kind()));
        put(" ");
        return node(n.at(0));
      case NodeKind::for_sign:
        put("for sign ");
        return node(n.at(0));
      case NodeKind::combine: {
        Nodes header;
        Nodes body;
        head(n, header, body);
        put("combine ");
        node(header.at(0));
        put(" with ");
        node(header.at(1));
        return block(n, body, end_of(header, n));
      }
      case NodeKind::combine_rule:
        node(n.at(0));
        put(" from ");
        return node(n.at(1));
      case NodeKind::include:
      case NodeKind::remove: {
        put(identifier(n.kind()));
        std::uint32_t count = 0;
        for (NodeRef c : n.children()) count += c.is(NodeKind::name) ? 1U : 0U;
        for (std::uint32_t i = 0; i < count; ++i) {
          const bool from = n.is(NodeKind::include) && i + 1 == count;
          put(i == 0 ? " " : from ? " from " : ", ");
          node(n.at(i));
        }
        return;
      }
      case NodeKind::degree:
        put("degree ");
        node(n.child(NodeKind::name));
        put(" = ");
        return node(n.child(NodeKind::quantity));
      case NodeKind::landmark:
        put("landmark");
        for (NodeRef c : n.children()) {
          if (c.kind() == NodeKind::doc_comment) continue;
          put(" ");
          node(c);
        }
        return;
      case NodeKind::params:
        return in_parens(n, NodeKind::param);
      case NodeKind::param:
        node(n.at(0));
        if (NodeRef value = n.at(1)) {
          put(" = ");
          node(value);
        }
        return;
      case NodeKind::place:
        node(n.at(0));
        put(" ");
        node(n.at(1));
        if (NodeRef v = n.at(2)) {
          put(" + ");
          node(v);
        }
        return;
      case NodeKind::vector:
        return in_parens(n, NodeKind::quantity);
      case NodeKind::property:
      case NodeKind::role:
      case NodeKind::locus: {
        if (n.kind() != NodeKind::property) {
          put(identifier(n.kind()));
          put(" ");
        }
        bool first = true;
        for (NodeRef c : n.children()) {
          if (!first) put(" ");
          node(c);
          if (first && c.kind() == NodeKind::quantity && n.kind() == NodeKind::property) put(" =");
          first = false;
        }
        return;
      }
      case NodeKind::options: {
        Nodes all;
        for (NodeRef c : n.children()) all.push_back(c);
        return items(all, "{", "}", n.node().end - 1, one_line(n.node().begin, n.node().end), Between::properties);
      }
      case NodeKind::profile:
        put("profile ");
        if (NodeRef name = n.child(NodeKind::name)) return node(name);
        return list(n, ", ", NodeKind::profile_point);
      case NodeKind::profile_point:
        node(n.at(0));
        put(n.at(1).is(NodeKind::name) ? " " : " at ");
        return node(n.at(1));
      case NodeKind::sum:
        return sum(n);
      case NodeKind::term:
      case NodeKind::factor: {
        for (NodeRef c : n.children()) {
          node(c);
          if (c.kind() == NodeKind::factor) put(c.has(kFlagStar) ? " * " : " ");
        }
        return;
      }
      case NodeKind::group:
        put("(");
        ++brackets_;
        node(n.at(0));
        return put_closing(n, ")");
      case NodeKind::call:
        node(n.at(0));
        if (text_[n.node().end - 1] != ')') {  // gaze addressee
          put(" ");
          return node(n.at(1));
        }
        return in_parens(n, NodeKind::argument);
      case NodeKind::argument:
        node(n.at(0));
        if (n.has(kFlagNamed)) {
          put(" = ");
          node(n.at(1));
        }
        return;
      case NodeKind::facs:
        put("facs ");
        return node(n.at(0));
      case NodeKind::mouthing:
        put("mouthing ");
        return node(n.at(0));
      case NodeKind::steps:
        return steps(n);
      case NodeKind::step:
        node(n.at(0));
        put(": ");
        node(n.at(1));
        return options_of(n);
      case NodeKind::placement:
        for (NodeRef c : n.children()) {
          if (c.kind() != NodeKind::sum) put(" ");
          node(c);
        }
        return;
      case NodeKind::over:
      case NodeKind::on:
      case NodeKind::duration:
      case NodeKind::else_:
      case NodeKind::pause:
        put(n.kind() == NodeKind::duration ? "for" : identifier(n.kind()));
        put(" ");
        return node(n.at(0));
      case NodeKind::at:
        put("at ");
        node(n.at(0));
        if (NodeRef d = n.at(1)) {
          put(" ");
          node(d);
        }
        return;
      case NodeKind::span:
        node(n.at(0));
        if (NodeRef second = n.at(1)) {
          put("..");
          node(second);
        }
        return;
      case NodeKind::span_end:
        node(n.at(0));
        if (NodeRef otherwise = n.at(1)) {
          put(" ");
          node(otherwise);
        }
        return;
      case NodeKind::tagged_sign:
        put("sign ");
        return node(n.at(0));
      case NodeKind::point:
        node(n.at(0));
        if (NodeRef o = n.at(1)) node(o);
        return;
      case NodeKind::anchor: {
        const std::string_view t = n.text();
        if (!n.at(0)) return words(n);
        put(t.substr(0, 2) == "ma"    ? "mark "
            : t.substr(0, 3) == "str" ? "stroke end of "
            : t.substr(0, 2) == "st"  ? "start of "
                                      : "end of ");
        return node(n.at(0));
      }
      case NodeKind::offset:
        put(n.has(kFlagMinus) ? " - " : " + ");
        return node(n.at(0));
      case NodeKind::when:
        put(n.has(kFlagUnless) ? "unless " : "when ");
        node(n.at(0));
        return block_after(n, 1);
      case NodeKind::condition:
        if (n.at(0).node().begin > n.node().begin) put("sign ");
        node(n.at(0));
        if (NodeRef second = n.at(1)) {
          put(n.at(0).node().begin > n.node().begin ? " in " : " is ");
          node(second);
        }
        return;
      case NodeKind::optional:
        put("optional ");
        return node(n.at(0));
      case NodeKind::one_of:
        put("one of");
        return block_after(n, 0);
      case NodeKind::signs: {
        put(n.has(kFlagNonDominant) ? "signs nd " : "signs ");
        Nodes all;
        for (NodeRef c : n.children()) all.push_back(c);
        return items(all, "{", "}", n.node().end - 1, one_line(n.node().begin, n.node().end), Between::blanks);
      }
      case NodeKind::sign:
        for (NodeRef c : n.children()) node(c);
        return;
      case NodeKind::tag:
        put("{");
        node(n.at(0));
        if (NodeRef count = n.at(1)) {
          put(" ");
          node(count);
        }
        return put("}");
      case NodeKind::sign_time:
        put("@");
        node(n.at(0));
        put("..");
        node(n.at(1));
        if (NodeRef held = n.at(2)) {
          put("~");
          node(held);
        }
        return;
      case NodeKind::alias:
        put(" as ");
        return node(n.at(0));
      case NodeKind::bracket:
        return bracket(n);
      case NodeKind::role_shift: {
        put("rs(");
        node(n.at(0));
        put(")[ ");
        node(n.at(1));
        put(" ]");
        if (text_[n.node().end - 1] == '}') block_after(n, 2);
        return;
      }
      case NodeKind::play:
      case NodeKind::ambience: {
        put(n.is(NodeKind::play) ? "play " : "ambient ");
        node(n.at(0));
        if (n.child(NodeKind::argument)) {
          put("(");
          ++brackets_;
          list(n, ", ", NodeKind::argument);
          --brackets_;
          put(")");
        }
        if (NodeRef d = n.child(NodeKind::duration)) {
          put(" ");
          node(d);
        }
        return;
      }
      case NodeKind::expect:
        put("expect");
        for (NodeRef c : n.children()) {
          put(" ");
          node(c);
        }
        return;
      case NodeKind::tolerance:
        put("+- ");
        return node(n.at(0));
      case NodeKind::from_to:
        put("from ");
        node(n.at(0));
        put(" to ");
        return node(n.at(1));
      case NodeKind::edge_sign:
      case NodeKind::per_cycle:
        return words(n);
      case NodeKind::function:
      case NodeKind::sides:
      case NodeKind::muscle_kind:
      case NodeKind::au_token:
      case NodeKind::name:
      case NodeKind::quantity:
      case NodeKind::string:
      case NodeKind::gloss:
      case NodeKind::fill:
      case NodeKind::comparison:
        return leaf(n);
    }
  }

  void options_of(NodeRef n) {
    if (NodeRef o = n.child(NodeKind::options)) {
      put(" ");
      node(o);
    }
  }

  // The block of a node whose first `header` children stand before it.
  void block_after(NodeRef n, std::uint32_t header) {
    Nodes body;
    std::uint32_t at = 0;
    std::uint32_t header_end = n.node().begin;
    for (NodeRef c : n.children()) {
      if (at++ < header)
        header_end = c.node().end;
      else
        body.push_back(c);
    }
    block(n, body, header_end);
  }

  void terms(NodeRef n, bool fill) {
    bool first = true;
    for (NodeRef t : n.children()) {
      if (over_) return;
      if (!first) put(t.has(kFlagMinus) ? " - " : " + ");
      if (fill && !comment_before(t.node().end)) {
        // A term that does not fit begins a line, and is written as it comes if it does not fit there either.
        if (!try_flat([&] { node(t); })) {
          if (!first) line_break(indent_ + 2);
          if (!try_flat([&] { node(t); })) node(t);
        }
      } else {
        node(t);
      }
      first = false;
    }
  }

  void sum(NodeRef n) {
    if (flat_ > 0) return terms(n, false);
    if (!comment_before(n.node().end) && try_flat([&] { terms(n, false); })) return;
    terms(n, true);
  }

  void steps(NodeRef n) {
    const auto flat = [&] {
      put("(");
      bool first = true;
      for (NodeRef s : n.children()) {
        if (over_) return;
        if (!first) put("; ");
        first = false;
        node(s);
      }
      put(")");
    };
    if (flat_ > 0) return flat();
    if (!comment_before(n.node().end) && one_line(n.node().begin, n.node().end) && try_flat(flat)) return;
    Nodes all;
    for (NodeRef c : n.children()) all.push_back(c);
    items(all, "(", ")", n.node().end - 1, false, Between::semicolons);
  }

  void bracket(NodeRef n) {
    node(n.at(0));
    Nodes inner;
    for (NodeRef c : n.children())
      if (c.kind() == NodeKind::sign || c.kind() == NodeKind::bracket) inner.push_back(c);
    if (n.child(NodeKind::argument)) {
      put("(");
      ++brackets_;
      list(n, ", ", NodeKind::argument);
      --brackets_;
      put(")");
    }
    const NodeRef options = n.child(NodeKind::options);
    const std::uint32_t end = options ? options.node().begin : n.node().end;
    items(inner, "[", "]", end - 1, one_line(n.node().begin, end), Between::blanks);
    options_of(n);
  }
};

}  // namespace

FormattedText format_statements(const Tree& tree) { return Formatter(tree).run(); }

std::string format(const Tree& tree) {
  if (has_errors(tree)) return std::string(tree.source().text());
  return Formatter(tree).run().text;
}

}  // namespace nms::lang
