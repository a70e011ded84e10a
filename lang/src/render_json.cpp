#include <nms/lang/render.h>
#include <nlohmann/json.hpp>

namespace nms::lang {
namespace {

using Json = nlohmann::ordered_json;

Json position(const Source& source, std::uint32_t offset) {
  const Position p = source.position(offset);
  return {{"line", p.line}, {"column", p.column}, {"offset", offset}};
}

void place(Json& out, const Source* source, Range range) {
  if (source == nullptr) {
    out["file"] = nullptr;
    out["range"] = nullptr;
    return;
  }
  out["file"] = source->path();
  out["range"] = {{"start", position(*source, range.begin)}, {"end", position(*source, range.end)}};
}

}  // namespace

std::string render_json(const Diagnostics& diagnostics) {
  Json list = Json::array();
  for (const Diagnostic& d : diagnostics.all()) {
    Json one;
    one["kind"] = std::string(d.kind);
    one["severity"] = d.severity == Severity::error ? "error" : "warning";
    place(one, d.source.get(), d.range);
    one["message"] = d.message;
    one["labels"] = Json::array();
    for (const Label& l : d.labels) {
      Json label;
      place(label, l.source.get(), l.range);
      label["text"] = l.text;
      one["labels"].push_back(std::move(label));
    }
    one["help"] = d.helps;
    one["fields"] = Json::object();
    for (const Field& f : d.fields) one["fields"][f.name] = f.value;
    list.push_back(std::move(one));
  }
  Json all;
  all["diagnostics"] = std::move(list);
  all["errors"] = diagnostics.error_count();
  all["warnings"] = diagnostics.warning_count();
  return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace nms::lang
