#include <nms/lang/tree.h>

namespace nms::lang {

std::string_view describe(NodeKind kind) {
  switch (kind) {
#define NMS_X(kind, text) \
  case NodeKind::kind:    \
    return text;
    NMS_NODE_KINDS(NMS_X)
#undef NMS_X
  }
  return "";
}

std::string_view identifier(NodeKind kind) {
  // `else_` is spelt so for C++ only.
  if (kind == NodeKind::else_) return "else";
  switch (kind) {
#define NMS_X(kind, text) \
  case NodeKind::kind:    \
    return #kind;
    NMS_NODE_KINDS(NMS_X)
#undef NMS_X
  }
  return "";
}

bool has_errors(const Tree& tree) {
  const NodeList& nodes = tree.nodes();
  for (std::uint32_t i = 0; i < nodes.size(); ++i)
    if (nodes.kind(i) == NodeKind::error || (nodes.flags(i) & kFlagError) != 0) return true;
  return false;
}

}  // namespace nms::lang
