#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
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

/// One node, as it is asked for.
struct Node {
  std::uint32_t begin = 0;  ///< bytes [begin, end) of the source
  std::uint32_t end = 0;
  std::uint32_t next = 0;  ///< index just past this node's last descendant
  NodeKind kind = NodeKind::file;
  std::uint8_t flags = 0;
};

/// A node of a small subtree whose shape is known: its kind, and how many nodes it holds, itself counted.
struct ShapeNode {
  NodeKind kind = NodeKind::file;
  std::uint32_t nodes = 1;
};

/// The nodes of a tree in pre-order: the first child of node i is i + 1, its next sibling is next(i).
///
/// A node takes eight bytes, since trees are what large files cost: kind, flags and beginning, then of a leaf its
/// length, of a parent how many nodes it holds and how far behind its last leaf it ends. The few that do not fit, such
/// as the file, stand in a table of their own.
class NodeList {
 public:
  static constexpr std::size_t kNodeBytes = 8;

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(nodes_.size()); }
  [[nodiscard]] NodeKind kind(std::uint32_t i) const { return static_cast<NodeKind>(nodes_[i] >> kKindAt & 0xFFU); }
  [[nodiscard]] std::uint8_t flags(std::uint32_t i) const {
    return static_cast<std::uint8_t>(nodes_[i] >> kFlagsAt & kFlagMask);
  }
  [[nodiscard]] std::uint32_t begin(std::uint32_t i) const {
    return form(nodes_[i]) == kFar ? far(i).begin : static_cast<std::uint32_t>(nodes_[i] >> kBeginAt & kMostBegin);
  }
  [[nodiscard]] std::uint32_t end(std::uint32_t i) const {
    const std::uint64_t n = nodes_[i];
    switch (form(n)) {
      case kLeaf:
        return begin(i) + static_cast<std::uint32_t>(n >> kRestAt);
      case kParent:
        return end(next(i) - 1) + static_cast<std::uint32_t>(n >> kTailAt);
      default:
        return far(i).end;
    }
  }
  [[nodiscard]] std::uint32_t next(std::uint32_t i) const {
    const std::uint64_t n = nodes_[i];
    switch (form(n)) {
      case kLeaf:
        return i + 1;
      case kParent:
        return i + static_cast<std::uint32_t>(n >> kRestAt & kMostNodes);
      default:
        return far(i).next;
    }
  }
  [[nodiscard]] Node operator[](std::uint32_t i) const { return {begin(i), end(i), next(i), kind(i), flags(i)}; }

  /// Whether the subtree of node `i` is one of these nodes, in pre-order, and none of them has flags.
  template <std::size_t N>
  [[nodiscard]] bool has_shape(std::uint32_t i, const std::array<ShapeNode, N>& shape) const {
    if (nodes_.size() - i < N) return false;
    bool same = true;
    for (std::size_t k = 0; k < N; ++k) {
      const bool leaf = shape[k].nodes == 1;
      const std::uint64_t wanted =
          packed(leaf ? kLeaf : kParent, shape[k].kind, 0, 0) | (leaf ? 0 : std::uint64_t{shape[k].nodes} << kRestAt);
      const std::uint64_t looked_at = kFormMask | std::uint64_t{0xFF} << kKindAt |
                                      std::uint64_t{kFlagMask} << kFlagsAt |
                                      (leaf ? 0 : std::uint64_t{kMostNodes} << kRestAt);
      same = same && (nodes_[i + k] & looked_at) == wanted;
    }
    return same;
  }

  /// Of a leaf that has_shape found.
  [[nodiscard]] Range near_range(std::uint32_t i) const {
    const std::uint64_t n = nodes_[i];
    const auto begin = static_cast<std::uint32_t>(n >> kBeginAt & kMostBegin);
    return {begin, begin + static_cast<std::uint32_t>(n >> kRestAt)};
  }

  // ---- building, by the parser
  void reserve(std::size_t count) { nodes_.reserve(count); }
  /// Gives back what was reserved for many more nodes than came.
  void shrink_if_sparse();
  /// A node whose end is not known yet: nothing but its beginning, kind and flags may be asked for.
  std::uint32_t open(NodeKind kind, std::uint32_t begin) {
    if (begin > kMostBegin) return open_far(kind, begin);
    nodes_.push_back(packed(kLeaf, kind, 0, begin));
    return size() - 1;
  }
  /// All nodes after `i` are its descendants. One that ends before it begins is empty, and begins there too.
  void close(std::uint32_t i, std::uint32_t end) {
    const std::uint64_t n = nodes_[i];
    const std::uint32_t begin = this->begin(i);
    const std::uint32_t count = size() - i;
    if (form(n) != kFar && end >= begin) {
      const std::uint64_t head = n & kHeadMask;
      if (count == 1 && end - begin <= kMostLength) {
        nodes_[i] = head | kLeaf | std::uint64_t{end - begin} << kRestAt;
        return;
      }
      const std::uint32_t last = this->end(size() - 1);
      if (count > 1 && count <= kMostNodes && end >= last && end - last <= kMostTail) {
        nodes_[i] = head | kParent | std::uint64_t{count} << kRestAt | std::uint64_t{end - last} << kTailAt;
        return;
      }
    }
    close_far(i, end);
  }
  void leaf(NodeKind kind, std::uint32_t begin, std::uint32_t end, std::uint8_t flags = 0) {
    if (begin > kMostBegin || end - begin > kMostLength) return leaf_far(kind, begin, end, flags);
    nodes_.push_back(packed(kLeaf, kind, flags, begin) | std::uint64_t{end - begin} << kRestAt);
  }
  /// Puts a parent around the last node, a leaf.
  std::uint32_t wrap_last(NodeKind kind) {
    const std::uint64_t inner = nodes_.back();
    if (form(inner) == kFar) return wrap_far(kind);
    const std::uint64_t begin = inner >> kBeginAt & kMostBegin;
    nodes_.back() = packed(kParent, kind, 0, begin) | std::uint64_t{2} << kRestAt;
    nodes_.push_back(inner);
    return size() - 2;
  }
  /// `60% AU12` as a term with one factor: four nodes. False, and nothing is added, where they would not fit.
  bool scaled_leaf(std::uint32_t number_begin, std::uint32_t number_end, NodeKind leaf, std::uint32_t leaf_begin,
                   std::uint32_t leaf_end) {
    if (leaf_end > kMostBegin || leaf_end - number_begin > kMostLength) return false;
    const std::uint64_t nodes[] = {
        packed(kParent, NodeKind::term, 0, number_begin) | std::uint64_t{4} << kRestAt,
        packed(kParent, NodeKind::factor, 0, number_begin) | std::uint64_t{2} << kRestAt,
        packed(kLeaf, NodeKind::quantity, 0, number_begin) | std::uint64_t{number_end - number_begin} << kRestAt,
        packed(kLeaf, leaf, 0, leaf_begin) | std::uint64_t{leaf_end - leaf_begin} << kRestAt};
    for (const std::uint64_t n : nodes) nodes_.push_back(n);
    return true;
  }
  /// `40%: p` as a step: five nodes. False, and nothing is added, where they would not fit.
  bool named_step(std::uint32_t share_begin, std::uint32_t share_end, std::uint32_t name_begin,
                  std::uint32_t name_end) {
    if (name_end > kMostBegin || name_end - share_begin > kMostLength) return false;
    const std::uint64_t name_length = std::uint64_t{name_end - name_begin} << kRestAt;
    const std::uint64_t nodes[] = {
        packed(kParent, NodeKind::step, 0, share_begin) | std::uint64_t{5} << kRestAt,
        packed(kLeaf, NodeKind::quantity, 0, share_begin) | std::uint64_t{share_end - share_begin} << kRestAt,
        packed(kParent, NodeKind::sum, 0, name_begin) | std::uint64_t{3} << kRestAt,
        packed(kParent, NodeKind::term, 0, name_begin) | std::uint64_t{2} << kRestAt,
        packed(kLeaf, NodeKind::name, 0, name_begin) | name_length};
    for (const std::uint64_t n : nodes) nodes_.push_back(n);
    return true;
  }
  void add_flags(std::uint32_t i, std::uint8_t bits) { nodes_[i] |= std::uint64_t{bits} << kFlagsAt; }
  void set_kind(std::uint32_t i, NodeKind kind) {
    nodes_[i] = (nodes_[i] & ~(std::uint64_t{0xFF} << kKindAt)) | std::uint64_t{static_cast<std::uint8_t>(kind)}
                                                                      << kKindAt;
  }
  /// Of a node that is open.
  void set_begin(std::uint32_t i, std::uint32_t begin);
  void truncate(std::uint32_t count) { nodes_.resize(count); }

 private:
  static constexpr unsigned kKindAt = 2, kFlagsAt = 10, kBeginAt = 16, kRestAt = 44, kTailAt = 56;
  static constexpr std::uint64_t kLeaf = 0, kParent = 1, kFar = 2, kFormMask = 3;
  static constexpr std::uint64_t kHeadMask = (std::uint64_t{1} << kRestAt) - 1 - kFormMask;
  static constexpr std::uint8_t kFlagMask = 0x3F;
  static constexpr std::uint32_t kMostBegin = (1U << 28U) - 1, kMostLength = (1U << 20U) - 1;
  static constexpr std::uint32_t kMostNodes = (1U << 12U) - 1, kMostTail = (1U << 8U) - 1;

  struct Far {
    std::uint32_t begin, end, next;
  };
  [[nodiscard]] static std::uint64_t form(std::uint64_t n) { return n & kFormMask; }
  [[nodiscard]] static std::uint64_t packed(std::uint64_t form, NodeKind kind, std::uint8_t flags,
                                            std::uint64_t begin) {
    return form | std::uint64_t{static_cast<std::uint8_t>(kind)} << kKindAt | std::uint64_t{flags} << kFlagsAt |
           begin << kBeginAt;
  }
  [[nodiscard]] const Far& far(std::uint32_t i) const { return far_[nodes_[i] >> kBeginAt]; }
  std::uint32_t open_far(NodeKind kind, std::uint32_t begin);
  void close_far(std::uint32_t i, std::uint32_t end);
  std::uint32_t wrap_far(NodeKind kind);
  void leaf_far(NodeKind kind, std::uint32_t begin, std::uint32_t end, std::uint8_t flags);

  std::vector<std::uint64_t> nodes_;
  std::vector<Far> far_;
};

}  // namespace nms::lang
