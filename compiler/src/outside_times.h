#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <nms/compiler/time_table.h>
#include <nms/lang/diagnostic.h>

namespace nms::compiler {

/// The tables of times of one compilation: who asks for what, and what nobody asked for.
class OutsideTimes {
 public:
  OutsideTimes() = default;
  /// Reports what is given twice. The tables must live on.
  OutsideTimes(const std::vector<TimeTable>& tables, lang::Diagnostics& diagnostics);

  /// A mark that a clip has asked for.
  struct Used {
    std::string_view name;
    std::int64_t time_ns = 0;
  };
  struct Uses {
    std::vector<Used> marks;
    std::unordered_set<std::string_view> names;
  };

  /// Says which clip is being made, as long as it lives: marks and signs are looked up for it.
  class InClip {
   public:
    InClip(OutsideTimes& times, std::string_view clip)
        : times_(times), outer_clip_(times.clip_), outer_uses_(std::move(times.uses_)) {
      times.clip_ = clip;
      times.uses_ = {};
    }
    ~InClip() {
      times_.clip_ = outer_clip_;
      times_.uses_ = std::move(outer_uses_);
    }
    InClip(const InClip&) = delete;
    InClip& operator=(const InClip&) = delete;
    /// The marks that have been asked for in it, each once.
    [[nodiscard]] const std::vector<Used>& used() const { return times_.uses_.marks; }

   private:
    OutsideTimes& times_;
    std::string_view outer_clip_;
    Uses outer_uses_;
  };

  /// The clip that is being made.
  [[nodiscard]] std::string_view clip() const { return clip_; }

  /// A mark of the clip that is being made, else one of any clip.
  [[nodiscard]] std::optional<std::int64_t> mark(std::string_view name);
  /// The marks that `mark` finds.
  [[nodiscard]] std::vector<std::string> mark_names() const;

  /// A row that gives a sign's times.
  struct SignRow {
    const TimeTable* table = nullptr;
    const SignTiming* timing = nullptr;
    bool used = false;
  };
  /// The rows for one hand of the utterance that is being made, in order.
  [[nodiscard]] std::vector<SignRow*> sign_rows(bool non_dominant);

  /// One warning for each table that has rows nobody asked for.
  void report_unused(lang::Diagnostics& diagnostics) const;

 private:
  struct MarkRow {
    const TimeTable* table = nullptr;
    const MarkTime* mark = nullptr;
    bool used = false;
  };
  std::vector<MarkRow> marks_;
  std::vector<SignRow> signs_;
  std::unordered_map<std::string, std::uint32_t> by_clip_and_name_;  ///< "clip\0name"
  std::unordered_map<std::string_view, std::vector<std::uint32_t>> signs_of_clip_;
  std::string_view clip_;
  Uses uses_;
};

}  // namespace nms::compiler
