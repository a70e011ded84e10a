// Canonical text for some lines of a file, all other bytes as they are.
//
// The whole is formatted; then the smallest statements that the lines touch are taken from it, and put in the place of
// what stands there. A statement can be taken alone if nothing else stands on its lines; neighbours that share a line
// are taken together; where the line is shared with what is around them, that is taken instead.
#include <algorithm>

#include <nms/lang/parse.h>

#include "format.h"

namespace nms::lang {
namespace {

bool blank(std::string_view text) { return text.find_first_not_of(" \t\r\f\v") == std::string_view::npos; }

/// Bytes of the source that give way to bytes of the canonical text.
struct Replacement {
  std::uint32_t begin = 0, end = 0;
  std::size_t with_begin = 0, with_end = 0;
};

class RangeFormatter {
 public:
  RangeFormatter(const Tree& tree, std::uint32_t first_line, std::uint32_t last_line)
      : text_(tree.source().text()), formatted_(format_statements(tree)) {
    begin_ = line_begin(first_line);
    end_ = line_begin(last_line + 1);
    if (end_ > begin_ && end_ <= text_.size() && text_[end_ - 1] == '\n') --end_;
  }

  std::string run() {
    choose(0, formatted_.statements.size());
    std::string out;
    std::uint32_t at = 0;
    for (const Replacement& r : chosen_) {
      out += text_.substr(at, r.begin - at);
      out += std::string_view(formatted_.text).substr(r.with_begin, r.with_end - r.with_begin);
      at = r.end;
    }
    out += text_.substr(at);
    return out;
  }

 private:
  using Statements = std::vector<FormattedStatement>;

  /// Where the line begins; past the last one: the end.
  std::uint32_t line_begin(std::uint32_t line) const {
    std::uint32_t at = 0;
    for (; line > 1; --line) {
      const std::size_t end = text_.find('\n', at);
      if (end == std::string_view::npos) return static_cast<std::uint32_t>(text_.size());
      at = static_cast<std::uint32_t>(end) + 1;
    }
    return at;
  }
  std::uint32_t line_begin_at(std::uint32_t byte) const {
    const std::size_t end = byte == 0 ? std::string_view::npos : text_.rfind('\n', byte - 1);
    return end == std::string_view::npos ? 0 : static_cast<std::uint32_t>(end) + 1;
  }
  std::uint32_t line_end_at(std::uint32_t byte) const {
    const std::size_t end = text_.find('\n', byte);
    return static_cast<std::uint32_t>(end == std::string_view::npos ? text_.size() : end);
  }
  bool touched(std::uint32_t begin, std::uint32_t end) const { return begin <= end_ && begin_ <= end; }

  /// Nothing but the end of a line, or a comment, stands behind `byte`.
  bool ends_line(std::uint32_t byte) const {
    const std::string_view rest = text_.substr(byte, line_end_at(byte) - byte);
    const std::size_t first = rest.find_first_not_of(" \t\r\f\v;");
    return first == std::string_view::npos || rest.substr(first, 2) == "//";
  }

  /// Chooses among the statements [from, to), neighbours in one block. False: one of them shares its line with the
  /// block around them.
  bool choose(std::size_t from, std::size_t to) {
    const Statements& all = formatted_.statements;
    const std::size_t before = chosen_.size();
    for (std::size_t i = from; i < to;) {
      // Those that share lines.
      std::size_t last = i;
      for (std::size_t next = all[i].next; next < to && !ends_line(all[last].node.range().end); next = all[next].next)
        last = next;
      const std::uint32_t begin = line_begin_at(all[i].node.range().begin);
      const std::uint32_t end = line_end_at(all[last].node.range().end);
      const std::size_t after = all[last].next;
      if (touched(begin, end)) {
        const bool alone =
            blank(text_.substr(begin, all[i].node.range().begin - begin)) && ends_line(all[last].node.range().end);
        if (!alone) {
          chosen_.resize(before);
          return false;
        }
        if (last != i || !choose_inside(i)) chosen_.push_back({begin, end, all[i].begin, all[last].end});
      }
      i = after;
    }
    return true;
  }

  /// Whether what is touched of a statement are whole statements inside it, which are chosen then.
  bool choose_inside(std::size_t i) {
    const Statements& all = formatted_.statements;
    if (all[i].next == i + 1) return false;
    // The lines of its header and of its end are its own.
    const std::uint32_t inner_begin = line_begin_at(all[i + 1].node.range().begin);
    std::uint32_t inner_end = 0;
    for (std::size_t k = i + 1; k < all[i].next; k = all[k].next) inner_end = line_end_at(all[k].node.range().end);
    if (begin_ < inner_begin || end_ > inner_end) return false;
    return choose(i + 1, all[i].next);
  }

  std::string_view text_;
  FormattedText formatted_;
  std::uint32_t begin_ = 0;
  std::uint32_t end_ = 0;
  std::vector<Replacement> chosen_;
};

}  // namespace

std::string format_range(const Tree& tree, std::uint32_t first_line, std::uint32_t last_line) {
  if (has_errors(tree)) return std::string(tree.source().text());
  return RangeFormatter(tree, first_line, last_line).run();
}

}  // namespace nms::lang
