#include <nms/compiler/diagnostic_kinds.h>

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace nms::compiler {
namespace {

using lang::Description;

std::string joined(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

void offer(Description& d, const std::vector<std::string>& nearest) {
  if (nearest.empty()) return;
  d.helps.push_back(fmt::format("did you mean {}?", fmt::join(nearest, " or ")));
  d.fields.push_back({"nearest", fmt::format("{}", fmt::join(nearest, " "))});
}

}  // namespace

Description UseNotFound::describe() const {
  return {fmt::format("there is no file \"{}\"", path),
          {"a use names a file beside this one, or one of the stdlib: use \"lexicons/asl.nms\""},
          {{"path", path}}};
}

Description UseCycle::describe() const {
  return {fmt::format("\"{}\" is in use of itself", path),
          {"move what both files need into a third file, and use that from both"},
          {{"path", path}}};
}

Description NotUtf8::describe() const {
  return {fmt::format("the byte 0x{:02X} is not UTF-8", byte),
          {"save the file as UTF-8; it may have been written in another encoding, as Latin-1"},
          {{"byte", fmt::format("0x{:02X}", byte)}}};
}

Description DuplicateName::describe() const {
  const bool vowel = !what.empty() && std::string_view("aeiou").find(what.front()) != std::string_view::npos;
  return {fmt::format("there is already {} {} named {}", vowel ? "an" : "a", what, name),
          {"rename one of the two, or remove it"},
          {{"what", what}, {"name", name}}};
}

Description UnknownName::describe() const {
  Description d{fmt::format("there is no {} named {}", what, name), {}, {{"what", what}, {"name", name}}};
  offer(d, nearest);
  return d;
}

Description UnknownActionUnit::describe() const {
  Description d{fmt::format("FACS has no {}", name), {}, {{"name", name}}};
  if (!nearest.empty()) {
    d.helps.push_back(fmt::format("the nearest are {}", fmt::join(nearest, " and ")));
    d.fields.push_back({"nearest", fmt::format("{}", fmt::join(nearest, " "))});
  }
  return d;
}

Description UnknownSide::describe() const {
  return {fmt::format("{} names a side, but {} has none", name, unit),
          {fmt::format("write {}: it moves both sides at once", unit)},
          {{"name", name}, {"unit", unit}}};
}

Description WrongKind::describe() const {
  Description d{fmt::format("{} is {}, and {} is needed here", name, found, expected),
                {},
                {{"name", name}, {"found", found}, {"expected", expected}}};
  if (!help.empty()) d.helps.push_back(help);
  return d;
}

Description RecursiveDefinition::describe() const {
  return {fmt::format("{} is made of itself", name),
          {"a definition may use only things that do not use it in turn"},
          {{"name", name}}};
}

Description UnitMismatch::describe() const {
  return {fmt::format("{} is {}, and {} is needed here", text, found, expected),
          {},
          {{"text", text}, {"found", found}, {"expected", expected}}};
}

Description UnexpectedArgument::describe() const {
  Description d{
      fmt::format("{} has no parameter for {}", name, argument), {}, {{"name", name}, {"argument", argument}}};
  d.helps.push_back(parameters.empty() ? fmt::format("{} takes no arguments", name)
                                       : fmt::format("its parameters are {}", joined(parameters)));
  return d;
}

Description MissingArgument::describe() const {
  if (parameter.empty())
    return {fmt::format("{}( ) needs one thing to keep a side of", name),
            {fmt::format("write it between the brackets: {}(AU12)", name)},
            {{"name", name}}};
  return {fmt::format("{} needs a value for {}", name, parameter),
          {fmt::format("give one, as in {}({} = ...), or give the parameter a default", name, parameter)},
          {{"name", name}, {"parameter", parameter}}};
}

Description UnknownPhone::describe() const {
  Description d{text.empty() ? std::string("a mouthing has no phones") : fmt::format("{} is no phone", phone),
                {"write IPA or X-SAMPA, \"bUk\", or ARPAbet with blanks, \"B UH1 K\"; a backslash is written twice"},
                {{"phone", phone}, {"text", text}}};
  return d;
}

Description BadFacsString::describe() const {
  return {fmt::format("\"{}\" in a FACS string {}", text, reason),
          {"write units joined by +, each with an optional side and intensity: \"1C+2C+L20B\"; alternatives by , or /"},
          {{"text", text}, {"reason", reason}}};
}

Description StepsNotWhole::describe() const {
  return {fmt::format("the steps come to {} of {}", sum, whole),
          {"the shares of all steps, and the times of those that have their own, must make up the whole"},
          {{"sum", sum}, {"whole", whole}}};
}

Description MissingDuration::describe() const {
  return {fmt::format("{} has no length of its own", name),
          {fmt::format(
              "say how long: `{0} over SPAN`, `{0} at POINT for 600ms`, or give it a length where it is declared; a "
              "pose may also say how long its apex is, `{0} at POINT {{ apex 100ms }}`",
              name)},
          {{"name", name}}};
}

Description UnknownSign::describe() const {
  Description d{fmt::format("{} is not signed in this utterance", name), {}, {{"name", name}}};
  offer(d, nearest);
  constexpr std::size_t kShown = 8;
  if (nearest.empty() && !known.empty()) {
    const auto shown = static_cast<std::ptrdiff_t>(std::min(kShown, known.size()));
    d.helps.push_back(fmt::format("there is {}{}", joined({known.begin(), known.begin() + shown}),
                                  known.size() > kShown ? ", ..." : ""));
  }
  return d;
}

Description AmbiguousSign::describe() const {
  if (utterance)
    return {
        fmt::format("{} is played more than once", name),
        {fmt::format("it begins at {}: write a time, or the name of a sign that is signed once", joined(candidates))},
        {{"name", name}, {"candidates", joined(candidates)}}};
  return {fmt::format("{} is signed more than once", name),
          {fmt::format("it stands at {}: name one with `as`, as in {}@0s..0.3s as n1", joined(candidates), name)},
          {{"name", name}, {"candidates", joined(candidates)}}};
}

Description AmbiguousLabel::describe() const {
  return {fmt::format("{} may be {}", label, fmt::join(candidates, " or ")),
          {fmt::format("write the name of the one that is meant: {}", fmt::join(candidates, " or "))},
          {{"label", label}, {"candidates", joined(candidates)}}};
}

Description SpanBackwards::describe() const {
  return {fmt::format("the span ends at {}, before it starts at {}", end, start),
          {"write the earlier end first"},
          {{"start", start}, {"end", end}}};
}

Description SpanTooShort::describe() const {
  return {fmt::format("lead and lag leave {} of the span", length),
          {"shorten the negative lead or lag, or lengthen the span"},
          {{"length", length}}};
}

Description BadProfile::describe() const {
  return {fmt::format("the profile's point {} {}", point, reason),
          {"write the points in order of time, between `start` and `end` of what the profile stands on"},
          {{"point", point}, {"reason", reason}}};
}

Description NoSigns::describe() const {
  return {fmt::format("{} needs signs, and there are none here", needed_by),
          {"write them in `signs { ... }`, or place it at a time: `at 0.2s for 600ms`"},
          {{"needed_by", needed_by}}};
}

Description SignTimes::describe() const {
  return {fmt::format("the times of {} {}", sign, reason),
          {"write SIGN@START..END, or SIGN@START..END~HELD, with START < END <= HELD, and signs in order of time; give "
           "every sign a time, or none"},
          {{"sign", sign}, {"reason", reason}}};
}

Description UnknownMark::describe() const {
  Description d{
      fmt::format("nothing says when the mark {} is in {}", name, clip), {}, {{"name", name}, {"clip", clip}}};
  offer(d, nearest);
  d.helps.push_back("a mark's time comes from a table of names and times: nmsc check FILE --marks TABLE.csv");
  return d;
}

Description MissingLexicon::describe() const {
  if (name.empty())
    return {fmt::format("{} is an entry's name, and no lexicon is named here", needed_by),
            {"say which: utterance NAME in asl { ... }, or discourse NAME in asl { ... }"},
            {{"needed_by", needed_by}}};
  Description d{fmt::format("there is no lexicon named {}", name), {}, {{"name", name}}};
  offer(d, nearest);
  d.helps.push_back("use the file that declares it: use \"my_lexicon.nms\"");
  return d;
}

Description UnknownProperty::describe() const {
  Description d{fmt::format("{} has no property {}", of, name), {}, {{"name", name}, {"of", of}}};
  offer(d, lang::nearest(name, known));
  if (!known.empty()) d.helps.push_back(fmt::format("its properties are {}", joined(known)));
  return d;
}

Description BadProperty::describe() const {
  return {fmt::format("{} is given {}, and takes {}", name, found, expected),
          {},
          {{"name", name}, {"found", found}, {"expected", expected}}};
}

Description MissingProperty::describe() const {
  return {fmt::format("{} needs {}", of, name), {}, {{"name", name}, {"of", of}}};
}

Description OutOfRange::describe() const {
  return {fmt::format("{} is outside {}", text, range), {}, {{"text", text}, {"range", range}}};
}

Description TooLarge::describe() const {
  return {fmt::format("{} is over the limit of {}", what, limit),
          {"split the source, or ask for less"},
          {{"what", what}, {"limit", limit}}};
}

Description CompetingMarkers::describe() const {
  return {fmt::format("{} and {} compete for {} from {} to {}", first, second, over, from, to),
          {"let one end before the other begins, or lower the intensity of one: NAME(40%)"},
          {{"first", first}, {"second", second}, {"over", over}, {"from", from}, {"to", to}}};
}

Description Antagonists::describe() const {
  const auto named = [](const std::string& unit, const std::string& cause) {
    return cause.find(unit) != std::string::npos ? cause : fmt::format("{} of {}", unit, cause);
  };
  return {fmt::format("{} is held against {} from {} to {}: no face does both", named(second_unit, second),
                      named(first_unit, first), from, to),
          {"move or shorten one of the two; where both are meant, state them in one pose or entry"},
          {{"first", first},
           {"first_unit", first_unit},
           {"second", second},
           {"second_unit", second_unit},
           {"from", from},
           {"to", to}}};
}

Description TooManyUses::describe() const {
  return {fmt::format("{} {}, and at most {} stand together", count, of, most),
          {"split the utterance, or take one of them for something else"},
          {{"of", of}, {"count", count}, {"most", most}}};
}

Description OutOfOrder::describe() const {
  return {fmt::format("{} comes after {}, and stands before it", name, other),
          {fmt::format("sign {} first", name)},
          {{"name", name}, {"other", other}}};
}

Description ExcludedEntry::describe() const {
  return {fmt::format("{} excludes {}, which is there from {} to {}", by, name, from, to),
          {fmt::format("leave one of them out, or give {} a span of its own", name)},
          {{"name", name}, {"by", by}, {"from", from}, {"to", to}}};
}

Description ExcludedSign::describe() const {
  return {tag.empty() ? fmt::format("{} excludes the sign {}", entry, sign)
                      : fmt::format("{} excludes signs with the tag {}, and {} has it", entry, tag, sign),
          {fmt::format("let {} begin after it, or end before it", entry)},
          {{"entry", entry}, {"sign", sign}, {"tag", tag}}};
}

Description LastsTooLong::describe() const {
  return {fmt::format("{} lasts {}; over {} it is {}", unit, length, longest, instead),
          {fmt::format("write {}, or shorten this", instead)},
          {{"unit", unit}, {"length", length}, {"longest", longest}, {"instead", instead}}};
}

Description PhasesShrunk::describe() const {
  return {
      fmt::format("the onset of {} wants {} and has {}: its phases are shortened in proportion", what, wanted, room),
      {"lengthen the span, add a lead, or write a shorter onset"},
      {{"what", what}, {"wanted", wanted}, {"room", room}}};
}

Description RateChanged::describe() const {
  return {fmt::format("{} takes whole cycles: its rate is {} instead of {}", what, used, wanted),
          {"lengthen the span, or write the rate that it has room for"},
          {{"what", what}, {"wanted", wanted}, {"used", used}}};
}

Description OutlastsTimeline::describe() const {
  return {fmt::format("this goes on until {}, past the timeline's {}", end, length),
          {"the clip is made longer; write the longer length, or place this earlier"},
          {{"end", end}, {"length", length}}};
}

Description SharedLabel::describe() const {
  if (is_name)
    return {fmt::format("the label {} of {} is another entry's name, and names come first", label, entry),
            {fmt::format("remove it: {} always means the entry of that name", label)},
            {{"label", label}, {"entry", entry}, {"other", other}}};
  return {fmt::format("{} and {} share the label {}", other, entry, label),
          {"whoever uses it has to write one of the names instead"},
          {{"label", label}, {"entry", entry}, {"other", other}}};
}

Description CyclesRounded::describe() const {
  return {fmt::format("{} has {} cycles, and takes half ones: {}", what, count, used),
          {"write a multiple of 0.5x"},
          {{"what", what}, {"count", count}, {"used", used}}};
}

Description Saturated::describe() const {
  return {fmt::format("{} adds up to {} and is held at {}", channel, sum, held),
          {},
          {{"channel", channel}, {"sum", sum}, {"held", held}}};
}

Description OneLip::describe() const {
  return {fmt::format("{} scores the {} lip alone, and {} moves both", text, lip, unit),
          {fmt::format("write it without {}, if both is what is meant", lip == "upper" ? "T" : "B")},
          {{"text", text}, {"unit", unit}, {"lip", lip}}};
}

Description UnusedTimes::describe() const {
  constexpr std::size_t kShown = 5;
  const std::vector<std::string> shown(names.begin(),
                                       names.begin() + static_cast<std::ptrdiff_t>(std::min(kShown, names.size())));
  const std::string more = names.size() > kShown ? fmt::format(" and {} more", names.size() - kShown) : std::string();
  return {
      fmt::format("nothing asks for the time of {}{}", joined(shown), more),
      {"a mark is asked for by `mark NAME` in its clip, a sign's times by the utterance and the sign that they name"},
      {{"names", joined(shown)}, {"count", fmt::format("{}", names.size())}}};
}

}  // namespace nms::compiler
