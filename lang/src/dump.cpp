#include <fmt/format.h>
#include <nms/lang/parse.h>

namespace nms::lang {
namespace {

// Printable on one line: other bytes as \xNN.
void quote(std::string& out, std::string_view text) {
  out += '\'';
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\n')
      out += "\\n";
    else if (byte < 32 || byte == 127)
      fmt::format_to(std::back_inserter(out), "\\x{:02X}", byte);
    else
      out += c;
  }
  out += '\'';
}

// Nodes that say something by their own words.
bool is_worded(NodeKind kind) {
  switch (kind) {
    case NodeKind::error:
    case NodeKind::doc_comment:
    case NodeKind::function:
    case NodeKind::sides:
    case NodeKind::muscle_kind:
    case NodeKind::au_token:
    case NodeKind::name:
    case NodeKind::quantity:
    case NodeKind::string:
    case NodeKind::gloss:
    case NodeKind::fill:
    case NodeKind::edge_sign:
    case NodeKind::anchor:
    case NodeKind::condition:
    case NodeKind::comparison:
      return true;
    default:
      return false;
  }
}

// `end of` of the anchor `end of WHERE`: the sign is a child, and prints its own words.
std::string_view own_words(const Tree& tree, std::uint32_t i) {
  const Node n = tree.nodes()[i];
  const bool has_child = n.next != i + 1;
  std::string_view words =
      tree.source().slice({n.begin, n.kind == NodeKind::anchor && has_child ? tree.nodes()[i + 1].begin : n.end});
  words.remove_suffix(words.size() - 1 - words.find_last_not_of(" \t\r\f\v"));
  return words;
}

}  // namespace

std::string dump(const Tree& tree) {
  std::string out;
  const NodeList& nodes = tree.nodes();
  std::vector<std::uint32_t> ends;  // of the open ancestors
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    const Node n = nodes[i];
    while (!ends.empty() && ends.back() <= i) ends.pop_back();
    out.append(2 * ends.size(), ' ');
    out += identifier(n.kind);
    if (is_worded(n.kind) && n.end > n.begin) {
      out += ' ';
      quote(out, own_words(tree, i));
    }
    if ((n.flags & kFlagStar) != 0) out += " *";
    if ((n.flags & kFlagNamed) != 0) out += " named";
    if ((n.flags & kFlagUnless) != 0) out += " unless";
    if ((n.flags & kFlagNonDominant) != 0) out += " nd";
    if ((n.flags & kFlagMinus) != 0) out += " minus";
    if ((n.flags & kFlagError) != 0) out += " [error]";
    out += '\n';
    if (n.next != i + 1) ends.push_back(n.next);
  }
  return out;
}

}  // namespace nms::lang
