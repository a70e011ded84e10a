// An expectation that failed, in words.
#include <fmt/format.h>

#include <nms/compiler/test.h>

namespace nms::compiler {
namespace {

std::string seconds(std::int64_t ns) { return fmt::format("{:.6g}s", static_cast<double>(ns) / 1e9); }

std::string shown(double value, lang::Unit unit) {
  if (value < 1e-7 && value > -1e-7) value = 0.0;
  switch (unit) {
    case lang::Unit::angle:
      return fmt::format("{:.4g}deg", value);
    case lang::Unit::length:
      return fmt::format("{:.4g}mm", value);
    default:
      return fmt::format("{:.4g}%", value * 100.0);
  }
}

std::string place(const Expectation& e) {
  return e.from_ns == e.to_ns ? fmt::format("at {}", seconds(e.from_ns))
                              : fmt::format("from {} to {}", seconds(e.from_ns), seconds(e.to_ns));
}

}  // namespace

lang::Description ExpectationFailed::describe() const {
  const Expectation& e = expectation;
  const auto value = [&e](const TestValue& v) {
    return fmt::format("{} at {}", shown(v.value, e.unit), seconds(v.time_ns));
  };
  std::string message = fmt::format("{} is {}", e.subject, value(e.first));
  const bool course = e.expected == "rises" || e.expected == "falls";
  if (course) message += fmt::format(", after {}", value(e.before));
  if (e.worst.time_ns != e.first.time_ns) message += fmt::format(", then {}", value(e.worst));
  message += fmt::format("; expected: {} {}", e.expected, place(e));
  lang::Description d{std::move(message), {}, {}};
  d.fields = {{"subject", e.subject},
              {"expected", e.expected},
              {"value", shown(e.first.value, e.unit)},
              {"time", seconds(e.first.time_ns)},
              {"worst", shown(e.worst.value, e.unit)},
              {"worst_time", seconds(e.worst.time_ns)},
              {"from", seconds(e.from_ns)},
              {"to", seconds(e.to_ns)}};
  if (e.causes.empty()) d.helps.push_back(fmt::format("nothing that is played moves {}", e.subject));
  return d;
}

lang::Diagnostic& report_failure(const Expectation& failed, lang::Diagnostics& diagnostics) {
  lang::Diagnostic& d = diagnostics.report(failed.source, failed.range, ExpectationFailed{failed});
  std::string values;
  for (const TestValue& v : failed.around)
    values += fmt::format("{}{} at {}", values.empty() ? "" : ", ", shown(v.value, failed.unit), seconds(v.time_ns));
  d.labels.push_back({failed.source, failed.sum_range, std::move(values)});
  for (const TestCause& c : failed.causes) {
    const std::string by = c.entry.empty() ? std::string() : fmt::format(" ({})", c.entry);
    d.labels.push_back({c.source, c.range,
                        c.then ? fmt::format("{} {}{}", c.channel, shown(c.value, lang::Unit::percent), by)
                               : fmt::format("{} at other times{}", c.channel, by)});
  }
  return d;
}

}  // namespace nms::compiler
