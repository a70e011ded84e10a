#include <nms/lang/source.h>

#include <algorithm>
#include <cstring>

namespace nms::lang {
namespace {

void build_lines(std::string_view text, std::vector<std::uint32_t>& begins) {
  if (!begins.empty()) return;
  begins.push_back(0);
  std::size_t at = 0;
  while (at < text.size()) {
    const void* found = std::memchr(text.data() + at, '\n', text.size() - at);
    if (found == nullptr) return;
    at = static_cast<std::size_t>(static_cast<const char*>(found) - text.data()) + 1;
    begins.push_back(static_cast<std::uint32_t>(at));
  }
}

}  // namespace

Position Source::position(std::uint32_t offset) const {
  build_lines(text_, line_begin_);
  offset = std::min(offset, static_cast<std::uint32_t>(text_.size()));
  const auto after = std::upper_bound(line_begin_.begin(), line_begin_.end(), offset);
  return {static_cast<std::uint32_t>(after - line_begin_.begin()), offset - *(after - 1) + 1};
}

std::string_view Source::line(std::uint32_t line) const {
  build_lines(text_, line_begin_);
  if (line == 0 || line > line_begin_.size()) return {};
  std::string_view text = std::string_view(text_).substr(line_begin_[line - 1]);
  text = text.substr(0, text.find('\n'));
  if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
  return text;
}

}  // namespace nms::lang
