#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nms/lang/diagnostic.h>

/// What can be wrong with the meaning of a source. Facts in fields; the words stand in diagnostic_kinds.cpp.
namespace nms::compiler {

/// Every kind: X(Struct, kind, severity). A golden test holds that each is shown by some file.
// clang-format off
#define NMS_COMPILER_DIAGNOSTICS(X)                       \
  X(UseNotFound, use_not_found, error)                    \
  X(UseCycle, use_cycle, error)                           \
  X(NotUtf8, not_utf8, error)                             \
  X(DuplicateName, duplicate_name, error)                 \
  X(UnknownName, unknown_name, error)                     \
  X(UnknownActionUnit, unknown_action_unit, error)        \
  X(UnknownSide, unknown_side, error)                     \
  X(WrongKind, wrong_kind, error)                         \
  X(RecursiveDefinition, recursive_definition, error)     \
  X(UnitMismatch, unit_mismatch, error)                   \
  X(UnexpectedArgument, unexpected_argument, error)       \
  X(MissingArgument, missing_argument, error)             \
  X(BadFacsString, bad_facs_string, error)                \
  X(UnknownPhone, unknown_phone, error)                 \
  X(StepsNotWhole, steps_not_whole, error)                \
  X(MissingDuration, missing_duration, error)             \
  X(UnknownSign, unknown_sign, error)                     \
  X(AmbiguousSign, ambiguous_sign, error)                 \
  X(AmbiguousLabel, ambiguous_label, error)               \
  X(SpanBackwards, span_backwards, error)                 \
  X(SpanTooShort, span_too_short, error)                  \
  X(BadProfile, bad_profile, error)                       \
  X(NoSigns, no_signs, error)                             \
  X(SignTimes, sign_times, error)                         \
  X(UnknownMark, unknown_mark, error)                     \
  X(MissingLexicon, missing_lexicon, error)               \
  X(UnknownProperty, unknown_property, error)             \
  X(BadProperty, bad_property, error)                     \
  X(MissingProperty, missing_property, error)             \
  X(OutOfRange, out_of_range, error)                      \
  X(TooLarge, too_large, error)                           \
  X(CompetingMarkers, competing_markers, error)           \
  X(Antagonists, antagonists, warning)                    \
  X(TooManyUses, too_many_uses, warning)                  \
  X(OutOfOrder, out_of_order, warning)                    \
  X(ExcludedEntry, excluded_entry, warning)               \
  X(ExcludedSign, excluded_sign, warning)                 \
  X(LastsTooLong, lasts_too_long, warning)                \
  X(PhasesShrunk, phases_shrunk, warning)                 \
  X(RateChanged, rate_changed, warning)                   \
  X(OutlastsTimeline, outlasts_timeline, warning)         \
  X(SharedLabel, shared_label, warning)                   \
  X(CyclesRounded, cycles_rounded, warning)               \
  X(Saturated, saturated, warning)                        \
  X(OneLip, one_lip, warning)                             \
  X(UnusedTimes, unused_times, warning)
// clang-format on

#define NMS_KIND(kind_, severity_)                                       \
  static constexpr std::string_view kKind = #kind_;                      \
  static constexpr lang::Severity kSeverity = lang::Severity::severity_; \
  [[nodiscard]] lang::Description describe() const

/// A `use` names a file that is neither beside the using file nor in the stdlib.
struct UseNotFound {
  NMS_KIND(use_not_found, error);
  std::string path;
};
/// Files use one another in a circle.
struct UseCycle {
  NMS_KIND(use_cycle, error);
  std::string path;
};
/// A byte that is not part of UTF-8, in a name, a gloss, a string or a comment.
struct NotUtf8 {
  NMS_KIND(not_utf8, error);
  unsigned byte;
};
/// Two declarations of one kind share a name. Label: the first one.
struct DuplicateName {
  NMS_KIND(duplicate_name, error);
  std::string what;
  std::string name;
};
struct UnknownName {
  NMS_KIND(unknown_name, error);
  std::string what;  ///< what kind of thing was looked for: "pose, expression or motion"
  std::string name;
  std::vector<std::string> nearest;
};
struct UnknownActionUnit {
  NMS_KIND(unknown_action_unit, error);
  std::string name;
  std::vector<std::string> nearest;
};
/// A side is asked of an AU that has none.
struct UnknownSide {
  NMS_KIND(unknown_side, error);
  std::string name;
  std::string unit;
};
/// A name stands where something of another kind is needed.
struct WrongKind {
  NMS_KIND(wrong_kind, error);
  std::string name;
  std::string found;     ///< "an expression"
  std::string expected;  ///< "a pose"
  std::string help;
};
struct RecursiveDefinition {
  NMS_KIND(recursive_definition, error);
  std::string name;
};
struct UnitMismatch {
  NMS_KIND(unit_mismatch, error);
  std::string text;
  std::string found;
  std::string expected;
};
struct UnexpectedArgument {
  NMS_KIND(unexpected_argument, error);
  std::string name;  ///< of what is called
  std::string argument;
  std::vector<std::string> parameters;
};
struct MissingArgument {
  NMS_KIND(missing_argument, error);
  std::string name;
  std::string parameter;
};
/// A mouthing's text is neither IPA and X-SAMPA nor ARPAbet.
struct UnknownPhone {
  NMS_KIND(unknown_phone, error);
  std::string phone;  ///< the first that is none
  std::string text;
};
struct BadFacsString {
  NMS_KIND(bad_facs_string, error);
  std::string text;
  std::string reason;
};
struct StepsNotWhole {
  NMS_KIND(steps_not_whole, error);
  std::string sum;
  std::string whole;
};
struct MissingDuration {
  NMS_KIND(missing_duration, error);
  std::string name;
};
struct UnknownSign {
  NMS_KIND(unknown_sign, error);
  std::string name;
  std::vector<std::string> nearest;
  std::vector<std::string> known;  ///< what could stand there, for when nothing is near
};
struct AmbiguousSign {
  NMS_KIND(ambiguous_sign, error);
  std::string name;
  std::vector<std::string> candidates;
  bool utterance = false;  ///< of a discourse, and no sign
};
/// A label that several entries of one lexicon have, where it is used. Labels: the entries.
struct AmbiguousLabel {
  NMS_KIND(ambiguous_label, error);
  std::string label;
  std::vector<std::string> candidates;  ///< names of entries
};
struct SpanBackwards {
  NMS_KIND(span_backwards, error);
  std::string start;
  std::string end;
};
/// Lead and lag leave nothing of a span.
struct SpanTooShort {
  NMS_KIND(span_too_short, error);
  std::string length;
};
/// A point of a profile that lies outside its span, or not after the one in front of it.
struct BadProfile {
  NMS_KIND(bad_profile, error);
  std::string point;
  std::string reason;
};
struct NoSigns {
  NMS_KIND(no_signs, error);
  std::string needed_by;
};
struct SignTimes {
  NMS_KIND(sign_times, error);
  std::string sign;
  std::string reason;
};
/// A mark that no table of times gives.
struct UnknownMark {
  NMS_KIND(unknown_mark, error);
  std::string name;
  std::string clip;
  std::vector<std::string> nearest;
};
struct MissingLexicon {
  NMS_KIND(missing_lexicon, error);
  std::string name;  ///< of the lexicon; empty: the utterance names none
  std::vector<std::string> nearest;
  std::string needed_by;  ///< the entry that is looked for, where the utterance names no lexicon
};
struct UnknownProperty {
  NMS_KIND(unknown_property, error);
  std::string name;
  std::string of;
  std::vector<std::string> known;
};
struct BadProperty {
  NMS_KIND(bad_property, error);
  std::string name;
  std::string found;
  std::string expected;
};
struct MissingProperty {
  NMS_KIND(missing_property, error);
  std::string name;
  std::string of;
};
struct OutOfRange {
  NMS_KIND(out_of_range, error);
  std::string text;
  std::string range;
};
struct TooLarge {
  NMS_KIND(too_large, error);
  std::string what;
  std::string limit;
};
/// Two grammatical markers at once that want contrary things, or two entries that compete. Label: the earlier one.
struct CompetingMarkers {
  NMS_KIND(competing_markers, error);
  std::string first;
  std::string second;
  std::string over;  ///< what both want: "AU1L and AU4L", or the name that `competes` gives it
  std::string from;
  std::string to;
};
/// Two causes of one layer hold units that no face can do together. Label: the earlier one.
struct Antagonists {
  NMS_KIND(antagonists, warning);
  std::string first;
  std::string first_unit;
  std::string second;
  std::string second_unit;
  std::string from;
  std::string to;
};
/// More uses of what competes for one thing than a clip may have. Label: the first of them.
struct TooManyUses {
  NMS_KIND(too_many_uses, warning);
  std::string of;
  std::string count;
  std::string most;
};
/// An entry after one that it stands `before`. Label: the other.
struct OutOfOrder {
  NMS_KIND(out_of_order, warning);
  std::string name;
  std::string other;
};
/// An entry at the same time as one that `excludes` it. Label: the one that does.
struct ExcludedEntry {
  NMS_KIND(excluded_entry, warning);
  std::string name;
  std::string by;
  std::string from;
  std::string to;
};
/// A sign in the span of an entry that `excludes sign` its tag or gloss. Label: the sign.
struct ExcludedSign {
  NMS_KIND(excluded_sign, warning);
  std::string entry;
  std::string sign;
  std::string tag;  ///< empty: its gloss is what is excluded
};
/// A unit that lasts longer than FACS scores it.
struct LastsTooLong {
  NMS_KIND(lasts_too_long, warning);
  std::string unit;
  std::string length;
  std::string longest;
  std::string instead;
};
struct PhasesShrunk {
  NMS_KIND(phases_shrunk, warning);
  std::string what;
  std::string wanted;
  std::string room;
};
struct RateChanged {
  NMS_KIND(rate_changed, warning);
  std::string what;
  std::string wanted;
  std::string used;
};
struct OutlastsTimeline {
  NMS_KIND(outlasts_timeline, warning);
  std::string end;
  std::string length;
};
/// A label that is another entry's label, or its name, where it is declared. Label: that entry.
struct SharedLabel {
  NMS_KIND(shared_label, warning);
  std::string label;
  std::string entry;
  std::string other;
  bool is_name;  ///< of the other
};
/// A count of cycles that is no multiple of a half.
struct CyclesRounded {
  NMS_KIND(cycles_rounded, warning);
  std::string what;
  std::string count;
  std::string used;
};
struct Saturated {
  NMS_KIND(saturated, warning);
  std::string channel;
  std::string sum;
  std::string held;  ///< where it is held: 100%, 0%, or -100% on an axis
};
/// A FACS string scores one lip alone, and the unit moves both.
struct OneLip {
  NMS_KIND(one_lip, warning);
  std::string text;  ///< "T23B"
  std::string unit;  ///< "AU23"
  std::string lip;   ///< upper, lower
};
/// Rows of a table of times that nothing asked for.
struct UnusedTimes {
  NMS_KIND(unused_times, warning);
  std::vector<std::string> names;
};

#undef NMS_KIND

}  // namespace nms::compiler
