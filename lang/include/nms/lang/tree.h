#pragma once

#include <cassert>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include <nms/lang/source.h>

namespace nms::lang {

/// Every kind of node: X(kind, "what a person calls it"). The comment gives its children in order;
/// `?` may be missing, `*` any number, `|` either. A node's text is the source it covers.
// clang-format off
#define NMS_NODE_KINDS(X)                                                                                              \
  X(file, "file")                     /* Declaration* */                                                               \
  X(error, "error")                   /* skipped text; no children. A tree with one has a diagnostic for it. */        \
  /* ---- declarations: all may be preceded by DocComment* as first children */                                       \
  X(doc_comment, "doc comment")       /* one `///` line, text without the slashes and one blank */                    \
  X(use, "use")                       /* string */                                                                     \
  X(pose, "pose")                     /* name params? (sum) */                                                         \
  X(expression, "expression")         /* name params? quantity? step* */                                               \
  X(motion, "motion")                 /* name params? (steps | sum) */                                                 \
  X(timeline, "timeline")             /* name params? quantity? (placement | ambience)* */                             \
  X(lexicon, "lexicon")               /* name string? extends? (entry | combine | include | remove)* */                \
  X(extends, "extends")               /* name */                                                                       \
  X(entry, "entry")                   /* name params? function? for_sign? (property|profile|placement|when|optional|one_of)* */ \
  X(function, "function")             /* no children; text is the word: syntactic, lexical ... */                      \
  X(for_sign, "for sign")             /* string or gloss */                                                            \
  X(combine, "combine")               /* name name (combine_rule)* */                                                  \
  X(combine_rule, "combine rule")     /* name(what) name(from which), as `head from neg` */                            \
  X(include, "include")               /* name+ (entries) name(the last: their lexicon); `include mm, th from asl` */   \
  X(remove, "remove")                 /* name+ */                                                                      \
  X(utterance, "utterance")           /* name in? property* (signs | property | profile | placement | ambience | when)* */              \
  X(in, "in")                         /* name */                                                                       \
  X(discourse, "discourse")           /* name in? (role|locus|pause|role_shift|by|ambience|name)*; name = an utterance */ \
  X(ambient, "ambient")               /* name params? placement*; placement = sum fill? options? */                     \
  X(test, "test")                     /* string (play | expect)* */                                                    \
  X(degree, "degree")                 /* name quantity */                                                              \
  X(au, "au")                         /* quantity(bare number) string sides? property* */                              \
  X(axis, "axis")                     /* name au_token au_token property*; `100% = 75deg` is a property named "100%" */\
  X(track, "track")                   /* name property* */                                                             \
  X(muscle, "muscle")                 /* name sides? muscle_kind place* property* */                                   \
  X(face, "face")                     /* name (property | landmark | muscle)* */                                       \
  X(landmark, "landmark")             /* name sides? vector */                                                         \
  /* ---- parts of declarations */                                                                                    \
  X(params, "parameters")             /* param* */                                                                     \
  X(param, "parameter")               /* name quantity|name ? (the default) */                                         \
  X(sides, "sides")                   /* the word */                                                                   \
  X(muscle_kind, "muscle kind")       /* no children; text: linear, sheet ... */                                       \
  X(place, "place")                   /* name(role: from to at about) name(landmark) vector?(offset) */                \
  X(vector, "vector")                 /* quantity quantity quantity */                                                 \
  X(property, "property")             /* name|quantity value*; value = quantity name au_token string gloss vector sum */ \
  X(options, "options")               /* property* ; `{ onset 167ms lead 233ms }` */                                   \
  X(profile, "profile")               /* profile_point+ | name ; a property of its own form, inside options */         \
  X(profile_point, "profile point")   /* quantity (name start|end | point | gloss) */                                         \
  /* ---- what moves: sums of scaled things */                                                                        \
  X(sum, "sum")                       /* term+ */                                                                      \
  X(term, "term")                     /* factor* primary; primary = au_token name call facs mouthing group steps quantity */ \
  X(factor, "factor")                 /* quantity | name | group(arithmetic); kFlagStar if `*` is written; a name without it is a degree */ \
  X(group, "group")                   /* sum; `( ... )` */                                                             \
  X(call, "call")                     /* name argument*; also left(...), dominant(...) and `gaze addressee` forms */   \
  X(argument, "argument")             /* name?(keyword, kFlagNamed) (sum | quantity | name | string); a lone number or name is no sum */ \
  X(facs, "facs string")              /* string */                                                                     \
  X(mouthing, "mouthing")             /* string */                                                                     \
  X(steps, "steps")                   /* step+ ; `( 60%: A; 40%: B )` */                                               \
  X(step, "step")                     /* quantity sum options? */                                                      \
  X(au_token, "action unit")          /* no children; text AU12, AU14RC, AUL20B ... */                                 \
  X(name, "name")                     /* no children */                                                                \
  X(quantity, "quantity")             /* no children; text 60%, -200ms, 2.34s, 15deg, 2Hz, 3x, 8mm, 0.5 */             \
  X(string, "string")                 /* no children; text with its quotes */                                          \
  X(gloss, "gloss")                   /* no children; text as written, with its backquotes if any */                   \
  /* ---- placement: X over SPAN, X at POINT [for TIME], X on SIGN; X fill */                                         \
  X(placement, "placement")           /* sum (over|at|on)? (fill|per_cycle)? options? ; a bracketed use is `bracket` */ \
  X(over, "over")                     /* span */                                                                       \
  X(at, "at")                         /* point duration? */                                                            \
  X(on, "on")                         /* gloss or name */                                                              \
  X(duration, "for")                  /* quantity */                                                                   \
  X(fill, "fill")                     /* the word */                                                                   \
  X(per_cycle, "per cycle")           /* the words */                                                                  \
  X(span, "span")                     /* span_end (span_end)? ; one: a name's own span; two: A..B */                   \
  X(span_end, "span end")             /* point | gloss | (tagged_sign | edge_sign) else? */                            \
  X(else_, "else")                    /* span_end */                                                                   \
  X(tagged_sign, "tagged sign")       /* name; `sign wh` */                                                            \
  X(edge_sign, "edge sign")           /* text: `first sign`, `last sign` (any blanks between), `start`, `end` */       \
  X(point, "point")                   /* quantity | anchor, then offset? ; `end of R + 30ms` */                        \
  X(anchor, "anchor")                 /* gloss|name ? ; text begins start of, end of, stroke end of, mark; childless: start, end */ \
  X(offset, "offset")                 /* quantity; text holds the sign: `+ 30ms` */                                    \
  X(when, "when")                     /* condition (placement | property ...)* ; flags: kFlagUnless */                 \
  X(condition, "condition")           /* `sign TAG in SPAN`, or name name?: `polite`, `style is formal` */             \
  X(optional, "optional")             /* placement | one_of */                                                         \
  X(one_of, "one of")                 /* (placement | one_of)* */                                                                 \
  /* ---- the manual tier */                                                                                          \
  X(signs, "signs")                   /* (sign | bracket)* ; flags: kFlagNonDominant for `signs nd` */                 \
  X(sign, "sign")                     /* gloss tag? sign_time? alias? */                                               \
  X(tag, "tag")                       /* name? quantity?; `{wh}`, `{3x}`, `{wh 3x}` */                                 \
  X(sign_time, "sign time")           /* quantity quantity quantity? ; @ start .. end ~ held until */                  \
  X(alias, "alias")                   /* name; `as n1` */                                                              \
  X(bracket, "bracket")               /* name (argument*) (sign | bracket)* options? ; `topic[ ... ] { lead 1ms }` */  \
  /* ---- discourse and tests */                                                                                      \
  X(role, "role")                     /* name name|quantity* */                                                        \
  X(locus, "locus")                   /* name (quantity | name)* */                                                    \
  X(pause, "pause")                   /* quantity */                                                                   \
  X(role_shift, "role shift")         /* name(role) name(utterance) placement* ; `rs(skycap)[ the_reply ] { }` */      \
  X(by, "by")                         /* name (placement | ambience)* */                                               \
  X(ambience, "use of an ambient")    /* name argument*; `ambient alive(seed = 7)` */                                  \
  X(play, "play")                     /* name argument* duration? */                                                   \
  X(expect, "expect")                 /* sum comparison? quantity? tolerance? (at | over | from_to)? */                \
  X(comparison, "comparison")         /* text: == <= >= < > rises falls never */                                       \
  X(tolerance, "tolerance")           /* quantity; `+- 1%` */                                                          \
  X(from_to, "from to")               /* point|gloss point|gloss */
// clang-format on

enum class NodeKind : std::uint8_t {
#define NMS_X(kind, text) kind,
  NMS_NODE_KINDS(NMS_X)
#undef NMS_X
};

/// What a person calls a node of this kind.
[[nodiscard]] std::string_view describe(NodeKind kind);
/// The kind's name as a tree dump prints it ("for_sign").
[[nodiscard]] std::string_view identifier(NodeKind kind);

inline constexpr std::uint8_t kFlagError = 1;         ///< something in this node did not parse; do not lower it
inline constexpr std::uint8_t kFlagStar = 2;          ///< factor: written with `*`
inline constexpr std::uint8_t kFlagNamed = 4;         ///< argument: the first child is a keyword
inline constexpr std::uint8_t kFlagUnless = 8;        ///< when: written `unless`
inline constexpr std::uint8_t kFlagNonDominant = 16;  ///< signs: `signs nd`
inline constexpr std::uint8_t kFlagMinus = 32;        ///< term, offset: subtracted

/// One node, 16 bytes. Nodes stand in pre-order: the first child of node i is i + 1, its next sibling is nodes[i].next.
struct Node {
  std::uint32_t begin = 0;  ///< bytes [begin, end) of the source
  std::uint32_t end = 0;
  std::uint32_t next = 0;  ///< index just past this node's last descendant
  NodeKind kind = NodeKind::file;
  std::uint8_t flags = 0;
  std::uint16_t zero = 0;
};

class Tree;

/// A node in its tree; a cheap value. The tree outlives it. What did not parse may lack any child: one that does not
/// exist has no text and no children of its own, so a path of `at` and `child` need not be asked at every step.
class NodeRef {
 public:
  class Children;
  NodeRef() = default;
  NodeRef(const Tree* tree, std::uint32_t index) : tree_(tree), index_(index) {}

  [[nodiscard]] bool exists() const { return tree_ != nullptr; }
  explicit operator bool() const { return exists(); }
  [[nodiscard]] inline const Node& node() const;
  [[nodiscard]] NodeKind kind() const { return node().kind; }
  [[nodiscard]] bool is(NodeKind k) const { return exists() && kind() == k; }
  [[nodiscard]] bool has(std::uint8_t flag) const { return (node().flags & flag) != 0; }
  [[nodiscard]] Range range() const { return {node().begin, node().end}; }
  [[nodiscard]] inline std::string_view text() const;
  [[nodiscard]] std::uint32_t index() const { return index_; }
  [[nodiscard]] const Tree& tree() const { return *tree_; }
  [[nodiscard]] inline Children children() const;
  /// The first child of that kind, or one that does not exist.
  [[nodiscard]] inline NodeRef child(NodeKind k) const;
  /// The n-th child (from 0), or one that does not exist.
  [[nodiscard]] inline NodeRef at(std::uint32_t n) const;
  friend bool operator==(const NodeRef&, const NodeRef&) = default;

 private:
  const Tree* tree_ = nullptr;
  std::uint32_t index_ = 0;
};

/// A comment that is not a doc comment; the formatter puts it back.
struct Comment {
  Range range;  ///< from `//` to the end of its line
  bool own_line = false;
};

/// A parsed file. Any bytes give one. Immutable once parsed; owns its source.
class Tree {
 public:
  [[nodiscard]] NodeRef root() const { return {this, 0}; }
  [[nodiscard]] const Source& source() const { return *source_; }
  [[nodiscard]] const std::shared_ptr<const Source>& source_pointer() const { return source_; }
  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<Comment>& comments() const { return comments_; }

 private:
  friend class Parser;
  std::shared_ptr<const Source> source_;
  std::vector<Node> nodes_;
  std::vector<Comment> comments_;
};

class NodeRef::Children {
 public:
  class Iterator {
   public:
    Iterator(const Tree* tree, std::uint32_t index) : tree_(tree), index_(index) {}
    NodeRef operator*() const { return {tree_, index_}; }
    Iterator& operator++() {
      index_ = tree_->nodes()[index_].next;
      return *this;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const Tree* tree_;
    std::uint32_t index_;
  };
  Children(const Tree* tree, std::uint32_t index) : tree_(tree), index_(index) {}
  [[nodiscard]] Iterator begin() const { return {tree_, index_ + 1}; }
  [[nodiscard]] Iterator end() const { return {tree_, tree_->nodes()[index_].next}; }
  [[nodiscard]] bool empty() const { return begin() == end(); }

 private:
  const Tree* tree_;
  std::uint32_t index_;
};

inline const Node& NodeRef::node() const {
  assert(tree_ != nullptr);
  return tree_->nodes()[index_];
}
inline std::string_view NodeRef::text() const {
  return tree_ != nullptr ? tree_->source().slice(range()) : std::string_view();
}
inline NodeRef::Children NodeRef::children() const { return {tree_, index_}; }
inline NodeRef NodeRef::child(NodeKind k) const {
  if (tree_ == nullptr) return {};
  for (NodeRef c : children())
    if (c.kind() == k) return c;
  return {};
}
inline NodeRef NodeRef::at(std::uint32_t n) const {
  if (tree_ == nullptr) return {};
  for (NodeRef c : children())
    if (n-- == 0) return c;
  return {};
}

}  // namespace nms::lang
