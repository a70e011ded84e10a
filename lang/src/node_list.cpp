#include <nms/lang/node_list.h>

namespace nms::lang {

void NodeList::shrink_if_sparse() {
  if (nodes_.size() < nodes_.capacity() / 2) nodes_.shrink_to_fit();
}

std::uint32_t NodeList::open_far(NodeKind kind, std::uint32_t begin) {
  nodes_.push_back(packed(kFar, kind, 0, far_.size()));
  far_.push_back({begin, begin, size()});
  return size() - 1;
}

void NodeList::close_far(std::uint32_t i, std::uint32_t end) {
  std::uint32_t begin = this->begin(i);
  if (end < begin) begin = end;
  const Far record{begin, end, size()};
  if (form(nodes_[i]) == kFar) {
    far_[nodes_[i] >> kBeginAt] = record;
    return;
  }
  nodes_[i] = packed(kFar, kind(i), flags(i), far_.size());
  far_.push_back(record);
}

void NodeList::leaf_far(NodeKind kind, std::uint32_t begin, std::uint32_t end, std::uint8_t flags) {
  nodes_.push_back(packed(kFar, kind, flags, far_.size()));
  far_.push_back({begin, end, size()});
}

std::uint32_t NodeList::wrap_far(NodeKind kind) {
  const std::uint64_t inner = nodes_.back();
  const Far record = far(size() - 1);
  nodes_.back() = packed(kFar, kind, 0, far_.size());
  far_[inner >> kBeginAt].next = size() + 1;
  far_.push_back({record.begin, record.end, size() + 1});
  nodes_.push_back(inner);
  return size() - 2;
}

void NodeList::set_begin(std::uint32_t i, std::uint32_t begin) {
  if (form(nodes_[i]) == kFar)
    far_[nodes_[i] >> kBeginAt].begin = begin;
  else
    nodes_[i] = packed(kLeaf, kind(i), flags(i), begin);
}

}  // namespace nms::lang
