#include "site_pages.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include <nms/program/play.h>

#include "decimal_seconds.h"
#include "manifest.h"
#include "xml_text.h"

namespace nms::cli {
namespace {

struct Word {
  std::string_view word;
  std::string_view text;
};

/// Functions as the index lists them: from the clause to the word, and what lies under both.
constexpr Word kFunctions[] = {
    {"syntactic", "Grammar of clauses and phrases"},
    {"discourse", "Discourse"},
    {"morphological", "Morphemes of the face"},
    {"lexical", "Lexical signs"},
    {"mouthing", "Mouthings"},
    {"prosody", "Prosody"},
    {"affect", "Affect"},
};

constexpr Word kEvidence[] = {
    {"opened", "the passage of the first source was read"}, {"abstract", "a summary of the first source was read"},
    {"secondary", "another work cites the first source"},   {"memory", "from memory, unchecked"},
    {"engineering", "no source: a choice of this library"},
};

constexpr const char* kMeta = R"(<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
)";

/// Source text keeps its lines.
std::string escaped_lines(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    // A comment begins at `//` outside of strings.
    std::size_t comment = line.size();
    bool quoted = false;
    for (std::size_t i = 0; i + 1 < line.size() && comment == line.size(); ++i) {
      if (line[i] == '"' && (i == 0 || line[i - 1] != '\\')) quoted = !quoted;
      if (!quoted && line[i] == '/' && line[i + 1] == '/') comment = i;
    }
    out += (at == 0 ? "" : "\n") + xml_escaped(line.substr(0, comment));
    if (comment != line.size()) out += "<span class=\"comment\">" + xml_escaped(line.substr(comment)) + "</span>";
    at = end + 1;
  }
  return out;
}

/// Without the indentation that all lines but the first have in common.
std::string outdented(std::string_view text) {
  std::size_t indent = std::string_view::npos;
  for (std::size_t at = text.find('\n'); at != std::string_view::npos; at = text.find('\n', at + 1)) {
    std::size_t i = at + 1;
    while (i < text.size() && text[i] == ' ') ++i;
    if (i < text.size() && text[i] != '\n') indent = std::min(indent, i - at - 1);
  }
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    out += text[i];
    if (text[i] != '\n' || indent == std::string_view::npos) continue;
    for (std::size_t n = 0; n < indent && i + 1 < text.size() && text[i + 1] == ' '; ++n) ++i;
  }
  return out;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

std::string joined(const std::vector<std::string>& words, std::string_view between) {
  std::string out;
  for (const std::string& w : words) out += (out.empty() ? std::string() : std::string(between)) + w;
  return out;
}

std::string_view function_of(const compiler::EntryRecord& e) {
  return e.function.empty() ? "lexical" : std::string_view(e.function);
}

std::string_view text_of(std::span<const Word> words, std::string_view word) {
  for (const Word& w : words)
    if (w.word == word) return w.text;
  return word;
}

/// Action units that a clip moves, without sides where both move: "AU4 Brow Lowerer".
struct MovedUnit {
  std::string name;
  std::string title;
};
std::vector<MovedUnit> moved_units(const program::Program& program, const program::Clip& clip) {
  const std::vector<std::string> names = units_moved(program, clip);
  const auto moves = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const auto title = [&](const std::string& name) {
    for (const program::Channel& c : program.channels) {
      if (program.string(c.name) == name) return std::string(program.string(c.title));
      if (c.kind != program::ChannelKind::axis ||
          (program.string(c.positive) != name && program.string(c.negative) != name))
        continue;
      std::string axis(program.string(c.name));
      std::replace(axis.begin(), axis.end(), '_', ' ');
      return axis;
    }
    return std::string();
  };
  std::vector<MovedUnit> out;
  for (const std::string& name : names) {
    const std::string stem = name.substr(0, name.size() - 1);
    if (name.ends_with('R') && moves(stem + "L")) continue;
    out.push_back({name.ends_with('L') && moves(stem + "R") ? stem : name, title(name)});
  }
  return out;
}

std::string unit_names(const program::Program& program, const program::Clip& clip) {
  std::vector<std::string> names;
  for (const MovedUnit& u : moved_units(program, clip)) names.push_back(u.name);
  return names.empty() ? std::string("nothing: it holds the face as it is") : joined(names, ", ");
}

std::string title_of(const SiteEntry& e) {
  return e.record->meaning.empty() ? e.record->name : fmt::format("{}: {}", e.record->name, e.record->meaning);
}

/// An entry of a lexicon that was made of several is looked for by any of its words.
std::string card(const SiteLexicon& lexicon, const SiteEntry& e) {
  const compiler::EntryRecord& r = *e.record;
  std::vector<std::string> words{
      r.name, r.meaning, r.function, r.evidence, lexicon.record->name, lexicon.record->title};
  for (const auto* more : {&r.labels, &r.aliases, &r.ids, &r.sources})
    words.insert(words.end(), more->begin(), more->end());
  words.push_back(unit_names(*lexicon.program, *e.clip));
  const std::string page = fmt::format("{}/{}", lexicon.record->name, r.name);
  return fmt::format(
      "<li data-search=\"{}\" data-lexicon=\"{}\" data-function=\"{}\"><a href=\"{}.html\"><img src=\"{}.png\" "
      "alt=\"\" "
      "width=\"150\" height=\"180\" loading=\"lazy\"/><span><strong>{}</strong><span>{}</span><span "
      "class=\"soft\">{}</span></span></a></li>\n",
      xml_escaped(lower(joined(words, " "))), xml_escaped(lexicon.record->name), xml_escaped(function_of(r)),
      xml_escaped(page), xml_escaped(page), xml_escaped(r.name), xml_escaped(r.meaning),
      xml_escaped(joined(r.labels, ", ")));
}

std::string head(std::string_view title, std::string_view root) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n{}<title>{}</title>\n"
      "<link rel=\"stylesheet\" href=\"{}assets/site.css\"/>\n<link rel=\"icon\" href=\"data:,\"/>\n</head>\n<body>\n"
      "<a class=\"skip\" href=\"#main\">Skip to content</a>\n",
      kMeta, xml_escaped(title), root);
}

std::string foot(std::string_view face) {
  return fmt::format("<footer>Made by nmsc {} on the face {}. Sides are the signer's own.</footer>\n", NMS_VERSION,
                     xml_escaped(face));
}

std::string list_row(std::string_view what, const std::string& html) {
  return html.empty() ? std::string() : fmt::format("<dt>{}</dt><dd>{}</dd>\n", what, html);
}

std::string codes(const std::vector<std::string>& words) {
  std::vector<std::string> out;
  for (const std::string& w : words) out.push_back("<code>" + xml_escaped(w) + "</code>");
  return joined(out, ", ");
}

std::string facts(const SiteLexicon& lexicon, const SiteEntry& e) {
  const compiler::EntryRecord& r = *e.record;
  std::vector<std::string> units;
  for (const MovedUnit& u : moved_units(*lexicon.program, *e.clip))
    units.push_back(u.title.empty()
                        ? xml_escaped(u.name)
                        : fmt::format("{} <span class=\"soft\">{}</span>", xml_escaped(u.name), xml_escaped(u.title)));
  std::string from =
      fmt::format("{} (<code>{}</code>)", xml_escaped(lexicon.record->title), xml_escaped(lexicon.record->name));
  if (r.lexicon != lexicon.record->name) from += fmt::format(", shared from <code>{}</code>", xml_escaped(r.lexicon));
  std::string out = "<dl>\n";
  out += list_row("Language", from);
  out += list_row("Function", xml_escaped(function_of(r)));
  out += list_row("Meaning", xml_escaped(r.meaning));
  out += list_row("Labels", codes(r.labels));
  out += list_row("Aliases", codes(r.aliases));
  out += list_row("Spreads over", xml_escaped(r.spreads));
  out += list_row("Played here",
                  fmt::format("{} s, alone, over a neutral sign", decimal_seconds(e.clip->end_ns - e.clip->start_ns)));
  out += list_row("Moves", units.empty() ? xml_escaped(unit_names(*lexicon.program, *e.clip)) : joined(units, "<br/>"));
  out += list_row("Row", codes(r.ids));
  return out + "</dl>\n";
}

std::string citations(const compiler::EntryRecord& r) {
  std::string out = "<section>\n<h2>Sources</h2>\n";
  if (!r.sources.empty()) {
    out += "<ul>\n";
    for (const std::string& s : r.sources) out += fmt::format("<li>{}</li>\n", xml_escaped(s));
    out += "</ul>\n";
  }
  if (!r.evidence.empty())
    out += fmt::format("<p>Evidence: <strong>{}</strong>, {}.</p>\n", xml_escaped(r.evidence),
                       text_of(kEvidence, r.evidence));
  return out + "</section>\n";
}

std::string tests_of(const SiteEntry& e) {
  std::string out = "<section>\n<h2>Tests that play it</h2>\n";
  if (e.tests.empty()) return out + "<p class=\"soft\">None was given.</p>\n</section>\n";
  for (const SiteTest& t : e.tests)
    out += fmt::format(
        "<details><summary>{} <span class=\"soft\">{}</span></summary><pre "
        "tabindex=\"0\"><code>{}</code></pre></details>\n",
        xml_escaped(t.name), xml_escaped(t.place), escaped_lines(t.text));
  return out + "</section>\n";
}

std::string stage(const SiteLexicon& lexicon, const SiteEntry& e) {
  const std::string what = fmt::format("{}. A face that moves {}.", title_of(e), unit_names(*lexicon.program, *e.clip));
  return fmt::format(
      R"(<div class="stage">
<canvas id="face" role="img" aria-label="{0}" data-clip="{1}" data-start="{2}" data-telling="{3}"></canvas>
<img id="still" class="still" src="{4}.png" alt="{0}" hidden="hidden"/>
<noscript><img class="still" src="{4}.png" alt="{0}"/></noscript>
<p id="problem" role="alert" hidden="hidden"></p>
<div id="controls" hidden="hidden">
<button id="play" type="button">Play</button>
<label class="time">Time <input id="time" type="range" min="0" max="1000" step="10" value="0"/></label>
<span id="clock">0.00 s</span>
<label>Speed <select id="speed"><option value="1">1</option><option value="0.5">1/2</option><option value="0.25">1/4</option></select></label>
<label>View <select id="view"><option value="front">front</option><option value="threequarter">three-quarter</option><option value="side">side</option></select></label>
</div>
</div>
)",
      xml_escaped(what), xml_escaped(lexicon.program->string(e.clip->name)), decimal_seconds(e.clip->start_ns),
      decimal_seconds(telling_time(*lexicon.program, *e.clip)), xml_escaped(e.record->name));
}

std::string ways(const SiteLexicon& lexicon, std::size_t index) {
  std::string out = "<nav class=\"ways\" aria-label=\"Entries\"><a href=\"../index.html\">All entries</a>";
  if (index > 0) {
    const std::string& name = lexicon.entries[index - 1].record->name;
    out += fmt::format("<a rel=\"prev\" href=\"{0}.html\">\u2190 Previous: {0}</a>", xml_escaped(name));
  }
  if (index + 1 < lexicon.entries.size()) {
    const std::string& name = lexicon.entries[index + 1].record->name;
    out += fmt::format("<a rel=\"next\" href=\"{0}.html\">Next: {0} \u2192</a>", xml_escaped(name));
  }
  return out + "</nav>\n";
}

std::string search_form(const std::vector<SiteLexicon>& lexicons) {
  std::string out =
      "<form id=\"search-form\" role=\"search\">\n<label>Search names, labels, meanings, sources, action units\n"
      "<input id=\"search\" type=\"search\" autocomplete=\"off\" aria-describedby=\"keys\"/></label>\n";
  if (lexicons.size() > 1) {
    out += "<label>Language <select id=\"language\"><option value=\"\">all</option>";
    for (const SiteLexicon& l : lexicons)
      out += fmt::format("<option value=\"{}\">{}</option>", xml_escaped(l.record->name), xml_escaped(l.record->title));
    out += "</select></label>\n";
  }
  out += "<label>Function <select id=\"function\"><option value=\"\">all</option>";
  for (const Word& f : kFunctions) out += fmt::format("<option value=\"{0}\">{0}</option>", f.word);
  return out +
         "</select></label>\n</form>\n<p id=\"keys\" class=\"soft\">Arrow keys go from the search to the entries, "
         "Enter "
         "opens the first.</p>\n<p id=\"count\" role=\"status\"></p>\n";
}

}  // namespace

std::int64_t telling_time(const program::Program& program, const program::Clip& clip) {
  constexpr int kLooks = 60;
  std::vector<float> values(program.channels.size());
  program::Player player(program, clip);
  std::int64_t best = clip.start_ns;
  float most = -1.0F;
  for (int i = 0; i <= kLooks; ++i) {
    const std::int64_t t = clip.start_ns + (clip.end_ns - clip.start_ns) / kLooks * i;
    player.advance(t, values);
    float all = 0.0F;
    for (const float v : values) all += std::fabs(v);
    // Of equal ones the first: later ones only by more than rounding.
    if (all <= most * 1.001F) continue;
    most = all;
    best = t;
  }
  return best;
}

std::string index_page(const std::vector<SiteLexicon>& lexicons, std::string_view face) {
  std::size_t count = 0;
  std::vector<std::string> titles;
  for (const SiteLexicon& l : lexicons) {
    count += l.entries.size();
    titles.push_back(l.record->title.empty() ? l.record->name : l.record->title);
  }
  std::string out = head("Non-manual signs: " + joined(titles, ", "), "");
  out += fmt::format(
      "<header>\n<h1>Non-manual signs</h1>\n<p class=\"lead\">{}: {} entries, each played alone on a "
      "face.</p>\n</header>\n<main id=\"main\">\n",
      xml_escaped(joined(titles, ", ")), count);
  out += search_form(lexicons);
  for (const SiteLexicon& l : lexicons) {
    out += fmt::format("<section data-group=\"\">\n<h2>{} <code>{}</code></h2>\n", xml_escaped(l.record->title),
                       xml_escaped(l.record->name));
    for (const Word& f : kFunctions) {
      std::string cards;
      for (const SiteEntry& e : l.entries)
        if (function_of(*e.record) == f.word) cards += card(l, e);
      if (!cards.empty())
        out += fmt::format("<section data-group=\"\">\n<h3>{}</h3>\n<ul class=\"entries\">\n{}</ul>\n</section>\n",
                           f.text, cards);
    }
    out += "</section>\n";
  }
  return out + "</main>\n" + foot(face) + "<script src=\"assets/site.js\"></script>\n</body>\n</html>\n";
}

std::string entry_page(const SiteLexicon& lexicon, std::size_t index, std::string_view face) {
  const SiteEntry& e = lexicon.entries[index];
  const compiler::EntryRecord& r = *e.record;
  std::string out = head(fmt::format("{} ({})", title_of(e), lexicon.record->name), "../");
  out += "<header>\n" + ways(lexicon, index);
  out += fmt::format("<h1>{}</h1>\n<p class=\"lead\">{}</p>\n</header>\n<main id=\"main\">\n", xml_escaped(r.name),
                     xml_escaped(r.comment.empty() ? r.meaning : r.comment));
  out +=
      "<div class=\"entry\">\n" + stage(lexicon, e) + "<div>\n" + facts(lexicon, e) + citations(r) + "</div>\n</div>\n";
  out += fmt::format(
      "<section>\n<h2>What moves, and when</h2>\n<div class=\"scroll\" tabindex=\"0\" role=\"group\" "
      "aria-label=\"Plot\"><img class=\"plot\" "
      "src=\"{}.svg\" alt=\"Curves over time, from {} s to {} s, of {}.\"/></div>\n</section>\n",
      xml_escaped(r.name), decimal_seconds(e.clip->start_ns), decimal_seconds(e.clip->end_ns),
      xml_escaped(unit_names(*lexicon.program, *e.clip)));
  out += fmt::format(
      "<section>\n<h2>As it is written</h2>\n<p class=\"soft\">{}, line {}</p>\n<pre "
      "tabindex=\"0\"><code>{}</code></pre>\n</section>\n",
      xml_escaped(r.file), r.line, escaped_lines(outdented(r.source->slice(r.range))));
  out += tests_of(e) + "</main>\n" + foot(face);
  return out +
         "<script src=\"../assets/viewer.js\"></script>\n<script src=\"face.js\"></script>\n<script "
         "src=\"../assets/site.js\"></script>\n</body>\n</html>\n";
}

}  // namespace nms::cli
