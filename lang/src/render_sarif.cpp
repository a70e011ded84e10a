#include <algorithm>
#include <vector>

#include <nms/lang/render.h>
#include <nlohmann/json.hpp>

namespace nms::lang {
namespace {

using Json = nlohmann::ordered_json;

/// Column from 1 in code points; SARIF's `unicodeCodePoints`.
std::size_t code_point_column(const Source& source, Position p) {
  const std::string_view line = source.line(p.line);
  const std::string_view before = line.substr(0, std::min<std::size_t>(p.column - 1, line.size()));
  return 1 + static_cast<std::size_t>(std::count_if(before.begin(), before.end(), [](char c) {
           return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
         }));
}

/// A path as a URI reference: everything that is not plain is escaped.
std::string uri(std::string_view path) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : path) {
    const auto u = static_cast<unsigned char>(c);
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("/-_.~").find(c) != std::string_view::npos;
    if (plain) {
      out += c;
    } else {
      out += '%';
      out += kHex[u >> 4U];
      out += kHex[u & 15U];
    }
  }
  return out;
}

Json location(const Source& source, Range range) {
  Json physical{{"artifactLocation", {{"uri", uri(source.path())}}}};
  if (!source.text().empty()) {  // what is said of a file as a whole has no region
    const Position begin = source.position(range.begin);
    const Position end = source.position(range.end);
    physical["region"] = {{"startLine", begin.line},
                          {"startColumn", code_point_column(source, begin)},
                          {"endLine", end.line},
                          {"endColumn", code_point_column(source, end)}};
  }
  return {{"physicalLocation", std::move(physical)}};
}

}  // namespace

std::string render_sarif(const Diagnostics& diagnostics, std::string_view version,
                         RuleText (*text_of)(std::string_view kind)) {
  std::vector<std::string_view> kinds;
  for (const Diagnostic& d : diagnostics.all())
    if (std::find(kinds.begin(), kinds.end(), d.kind) == kinds.end()) kinds.push_back(d.kind);
  std::sort(kinds.begin(), kinds.end());

  Json rules = Json::array();
  for (const std::string_view kind : kinds) {
    Json rule{{"id", std::string(kind)}};
    const RuleText text = text_of != nullptr ? text_of(kind) : RuleText{};
    if (!text.summary.empty()) rule["shortDescription"] = {{"text", text.summary}};
    if (!text.text.empty()) rule["help"] = {{"text", text.text}, {"markdown", text.markdown}};
    if (!text.group.empty()) rule["properties"] = {{"tags", Json::array({text.group})}};
    rules.push_back(std::move(rule));
  }
  Json results = Json::array();
  for (const Diagnostic& d : diagnostics.all()) {
    Json result;
    result["ruleId"] = std::string(d.kind);
    result["ruleIndex"] = std::lower_bound(kinds.begin(), kinds.end(), d.kind) - kinds.begin();
    result["level"] = d.severity == Severity::error ? "error" : "warning";
    std::string text = d.message;
    for (const std::string& help : d.helps) text += "\nhelp: " + help;
    result["message"] = {{"text", text}};
    if (d.source != nullptr) result["locations"] = Json::array({location(*d.source, d.range)});
    Json related = Json::array();
    for (const Label& l : d.labels) {
      if (l.source == nullptr) continue;
      Json one = location(*l.source, l.range);
      one["id"] = related.size();
      one["message"] = {{"text", l.text}};
      related.push_back(std::move(one));
    }
    if (!related.empty()) result["relatedLocations"] = std::move(related);
    Json properties = Json::object();
    for (const Field& f : d.fields) properties[f.name] = f.value;
    if (!properties.empty()) result["properties"] = std::move(properties);
    results.push_back(std::move(result));
  }
  Json run;
  run["tool"] = {{"driver", {{"name", "nmsc"}, {"version", std::string(version)}, {"rules", std::move(rules)}}}};
  run["columnKind"] = "unicodeCodePoints";
  run["results"] = std::move(results);
  Json all;
  all["$schema"] = "https://json.schemastore.org/sarif-2.1.0.json";
  all["version"] = "2.1.0";
  all["runs"] = Json::array({std::move(run)});
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace nms::lang
