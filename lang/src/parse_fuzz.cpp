// Any bytes give a sound tree; a tree without faults is kept by formatting, which is idempotent.
#include <cstdio>
#include <cstdlib>

#include <nms/lang/parse.h>
#include <nms/lang/render.h>

namespace {

using namespace nms::lang;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

void require_sound(const Tree& tree) {
  const NodeList& nodes = tree.nodes();
  require(nodes.size() != 0 && nodes[0].kind == NodeKind::file && nodes[0].next == nodes.size(), "root");
  std::vector<std::uint32_t> open{0};
  for (std::uint32_t i = 1; i < nodes.size(); ++i) {
    const Node n = nodes[i];
    while (nodes[open.back()].next <= i) open.pop_back();
    const Node parent = nodes[open.back()];
    require(n.next > i && n.next <= parent.next, "nesting of nodes");
    require(n.begin <= n.end && n.end <= tree.source().text().size(), "range");
    require(n.begin >= parent.begin && n.end <= parent.end, "range within the parent's");
    open.push_back(i);
  }
  std::vector<std::uint32_t> declared;
  for (NodeRef child : tree.root().children())
    if (!child.is(NodeKind::error)) declared.push_back(child.index());
  require(declared == tree.declarations(), "declarations");
  std::uint32_t last = 0;
  for (const Comment& c : tree.comments()) {
    require(c.range.begin >= last && c.range.end > c.range.begin, "comments in order");
    last = c.range.end;
  }
}

// Kinds, flags and the leaves' words; blanks inside a leaf do not count.
std::string shape(const Tree& tree) {
  std::string out;
  for (const char c : dump(tree))
    if (c != '\t' && c != '\r' && c != '\f' && c != '\v') out += c;
  std::string squeezed;
  for (const char c : out)
    if (c != ' ' || squeezed.empty() || squeezed.back() != ' ') squeezed += c;
  return squeezed;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const auto source =
      std::make_shared<Source>("fuzz.nms", std::string(reinterpret_cast<const char*>(data), size));  // bytes as text
  const auto tree = parse(source, diagnostics);
  require_sound(*tree);
  require(!dump(*tree).empty(), "a dump");
  const std::string text = format(*tree);
  if (diagnostics.error_count() > 0) {
    diagnostics.sort();
    require(!render_text(diagnostics, (size & 1U) != 0).empty(), "words");
    require(!render_json(diagnostics).empty(), "JSON");
    require(!render_sarif(diagnostics, "0").empty(), "SARIF");
    require(format_range(*tree, 1, 2) == source->text(), "what has errors is not formatted");
    return 0;
  }
  bool flagged = false;
  for (std::uint32_t i = 0; i < tree->nodes().size(); ++i)
    flagged = flagged || (tree->nodes().flags(i) & kFlagError) != 0 || tree->nodes().kind(i) == NodeKind::error;
  require(!flagged, "no error in the tree without a diagnostic");
  Diagnostics again;
  const auto second = parse(std::make_shared<Source>("formatted.nms", text), again);
  if (again.error_count() > 0) std::fprintf(stderr, "%s\n%s", text.c_str(), render_text(again, false).c_str());
  require(again.error_count() == 0, "formatted text parses");
  if (shape(*second) != shape(*tree)) std::fprintf(stderr, "%s\n", text.c_str());
  require(shape(*second) == shape(*tree), "formatting keeps the tree");
  require(second->comments().size() == tree->comments().size(), "formatting keeps comments");
  const std::string twice = format(*second);
  if (twice != text) std::fprintf(stderr, "first:\n%s\nsecond:\n%s\n", text.c_str(), twice.c_str());
  require(twice == text, "formatting is idempotent");
  // Lines picked by the input: the rest of the file is put back, and means the same.
  const auto first_line = static_cast<std::uint32_t>(1 + size % 17);
  const std::string part = format_range(*tree, first_line, first_line + static_cast<std::uint32_t>(size % 5));
  Diagnostics third_time;
  const auto third = parse(std::make_shared<Source>("part.nms", part), third_time);
  if (third_time.error_count() > 0) std::fprintf(stderr, "%s\n", part.c_str());
  require(third_time.error_count() == 0, "text formatted in part parses");
  require(format(*third) == text, "formatting a part keeps the tree");
  return 0;
}
