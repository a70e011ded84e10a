#pragma once

#include <cassert>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include <nms/lang/node_list.h>
#include <nms/lang/source.h>

namespace nms::lang {

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
  [[nodiscard]] inline Node node() const;
  [[nodiscard]] inline NodeKind kind() const;
  [[nodiscard]] bool is(NodeKind k) const { return exists() && kind() == k; }
  [[nodiscard]] inline bool has(std::uint8_t flag) const;
  [[nodiscard]] inline Range range() const;
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
  [[nodiscard]] const NodeList& nodes() const { return nodes_; }
  /// Nodes of what the file declares, in order: the root's children but for errors. Who looks for one kind of thing
  /// need not walk the tree.
  [[nodiscard]] const std::vector<std::uint32_t>& declarations() const { return declarations_; }
  [[nodiscard]] NodeRef at(std::uint32_t node) const { return {this, node}; }
  /// The text of a leaf that has_shape found: such a leaf's place stands in the node itself.
  [[nodiscard]] std::string_view near_text(std::uint32_t leaf) const {
    const Range range = nodes_.near_range(leaf);
    return {source_->text().data() + range.begin, range.end - range.begin};
  }
  [[nodiscard]] const std::vector<Comment>& comments() const { return comments_; }

 private:
  friend class Parser;
  std::shared_ptr<const Source> source_;
  NodeList nodes_;
  std::vector<std::uint32_t> declarations_;
  std::vector<Comment> comments_;
};

/// Whether something in the file did not parse.
[[nodiscard]] bool has_errors(const Tree& tree);

class NodeRef::Children {
 public:
  class Iterator {
   public:
    Iterator(const Tree* tree, std::uint32_t index) : tree_(tree), index_(index) {}
    NodeRef operator*() const { return {tree_, index_}; }
    Iterator& operator++() {
      index_ = tree_->nodes().next(index_);
      return *this;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const Tree* tree_;
    std::uint32_t index_;
  };
  Children(const Tree* tree, std::uint32_t index) : tree_(tree), index_(index) {}
  [[nodiscard]] Iterator begin() const { return {tree_, index_ + 1}; }
  [[nodiscard]] Iterator end() const { return {tree_, tree_->nodes().next(index_)}; }
  [[nodiscard]] bool empty() const { return begin() == end(); }

 private:
  const Tree* tree_;
  std::uint32_t index_;
};

inline Node NodeRef::node() const {
  assert(tree_ != nullptr);
  return tree_->nodes()[index_];
}
inline NodeKind NodeRef::kind() const {
  assert(tree_ != nullptr);
  return tree_->nodes().kind(index_);
}
inline bool NodeRef::has(std::uint8_t flag) const {
  assert(tree_ != nullptr);
  return (tree_->nodes().flags(index_) & flag) != 0;
}
inline Range NodeRef::range() const {
  assert(tree_ != nullptr);
  return {tree_->nodes().begin(index_), tree_->nodes().end(index_)};
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
