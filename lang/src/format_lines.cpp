#include "format_lines.h"

#include <algorithm>

namespace nms::lang {
namespace {

constexpr std::size_t kMostColumns = 100;

}  // namespace

void FormatLines::put(std::string_view s) {
  out_ += s;
  if (flat_ > 0 && out_.size() - line_begin_ > kMostColumns) over_ = true;
}

void FormatLines::line_break(int indent) {
  trim();
  out_ += '\n';
  line_begin_ = out_.size();
  out_.append(static_cast<std::size_t>(2 * indent), ' ');
  comment_ends_line_ = false;
}

void FormatLines::trim() {
  while (out_.size() > line_begin_ && out_.back() == ' ') out_.pop_back();
}

std::string_view FormatLines::comment_text(const Comment& c) const {
  std::string_view t = tree_.source().slice(c.range);
  while (!t.empty() && kBlanks.find(t.back()) != std::string_view::npos) t.remove_suffix(1);
  return t;
}

bool FormatLines::comment_before(std::uint32_t end) const {
  return comment_ < tree_.comments().size() && tree_.comments()[comment_].range.begin < end;
}

void FormatLines::put_trailing(std::string_view text, int indent) {
  if (comment_ends_line_ || out_.size() == line_begin_) {
    if (!out_.empty()) line_break(indent);
  } else {
    trim();
    out_ += "  ";
  }
  out_ += text;
  comment_ends_line_ = true;
}

void FormatLines::comments_before_token(std::uint32_t begin) {
  while (comment_before(begin)) {
    const Comment& c = tree_.comments()[comment_++];
    const std::size_t last = out_.find_last_not_of(' ');
    const bool may_break = brackets_ > 0 || (last != std::string::npos && last >= line_begin_ &&
                                             std::string_view("+-*=:,").find(out_[last]) != std::string_view::npos);
    if (!may_break && !comment_ends_line_) {
      pending_.push_back(&c);
      continue;
    }
    if (c.own_line && out_.find_first_not_of(' ', line_begin_) != std::string::npos) line_break(indent_ + 2);
    if (!c.own_line) {
      trim();
      out_ += "  ";
    }
    out_ += comment_text(c);
    line_break(indent_ + 2);
  }
}

std::size_t FormatLines::begin_statement(NodeRef n) {
  statements_.push_back({n, line_begin_, 0, 0});
  return statements_.size() - 1;
}

void FormatLines::end_statement(std::size_t i) {
  if (i == kNoStatement || statements_[i].next != 0) return;
  trim();
  statements_[i].end = out_.size();
  statements_[i].next = statements_.size();
}

void FormatLines::next_line(std::uint32_t begin, bool first, bool closing, std::size_t last) {
  for (const Comment* c : pending_) put_trailing(comment_text(*c), indent_);
  pending_.clear();
  while (comment_before(begin)) {
    const Comment& c = tree_.comments()[comment_++];
    if (c.own_line || out_.empty()) {
      end_statement(last);
      start_line(c.range.begin, first);
      out_ += comment_text(c);
      comment_ends_line_ = true;
    } else {
      put_trailing(comment_text(c), indent_);
    }
    first = first && !c.own_line;
    last_end_ = c.range.end;
  }
  end_statement(last);
  if (closing) return;
  start_line(begin, first);
}

void FormatLines::start_line(std::uint32_t begin, bool first) {
  const std::string_view gap = text_.substr(last_end_, begin > last_end_ ? begin - last_end_ : 0);
  const bool blank = !first && std::count(gap.begin(), gap.end(), '\n') > 1;
  if (out_.empty()) return;
  if (blank) {
    trim();
    out_ += '\n';
    line_begin_ = out_.size();
  }
  line_break(indent_);
}

}  // namespace nms::lang
