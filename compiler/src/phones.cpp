#include "phones.h"

namespace nms::compiler {
namespace {

// Engineering defaults, about the tempo of slow speech: a mouthing as a rule takes the length of its sign.
constexpr std::int64_t kConsonantNs = 80'000'000;
constexpr std::int64_t kVowelNs = 120'000'000;

struct Symbol {
  std::string_view text;
  std::string_view viseme;
  bool vowel = false;
};

/// IPA and X-SAMPA in one table: where X-SAMPA is ASCII and IPA is not they cannot clash, and the letters that they
/// share mean the same. Grouped by what is seen: place of articulation at the lips and teeth, rounding, opening.
constexpr Symbol kSymbols[] = {
    {"p", "p"},           {"b", "p"},           {"m", "p"},           {"p\\", "w"},         {"B", "w"},
    {"ɸ", "w"},           {"β", "w"},           {"ʙ", "p"},           {"f", "f"},           {"v", "f"},
    {"F", "f"},           {"ɱ", "f"},           {"v\\", "f"},         {"P", "f"},           {"ʋ", "f"},
    {"pf", "f"},          {"T", "th"},          {"D", "th"},          {"θ", "th"},          {"ð", "th"},
    {"t", "t"},           {"d", "t"},           {"n", "t"},           {"4", "t"},           {"ɾ", "t"},
    {"t`", "t"},          {"d`", "t"},          {"n`", "t"},          {"ʈ", "t"},           {"ɖ", "t"},
    {"ɳ", "t"},           {"s", "s"},           {"z", "s"},           {"ts", "s"},          {"dz", "s"},
    {"s`", "sh"},         {"z`", "sh"},         {"ʂ", "sh"},          {"ʐ", "sh"},          {"l", "l"},
    {"K", "l"},           {"L", "l"},           {"l`", "l"},          {"5", "l"},           {"ɬ", "l"},
    {"ʎ", "l"},           {"ɭ", "l"},           {"ɫ", "l"},           {"S", "sh"},          {"Z", "sh"},
    {"tS", "sh"},         {"dZ", "sh"},         {"ʃ", "sh"},          {"ʒ", "sh"},          {"tʃ", "sh"},
    {"dʒ", "sh"},         {"t_S", "sh"},        {"d_Z", "sh"},        {"s\\", "sh"},        {"z\\", "sh"},
    {"ɕ", "sh"},          {"ʑ", "sh"},          {"r", "r"},           {"r\\", "r"},         {"r`", "r"},
    {"ɹ", "r"},           {"ɻ", "r"},           {"ɽ", "r"},           {"k", "k"},           {"g", "k"},
    {"N", "k"},           {"x", "k"},           {"G", "k"},           {"C", "k"},           {"J", "k"},
    {"c", "k"},           {"q", "k"},           {"R", "k"},           {"X", "k"},           {"ŋ", "k"},
    {"ɡ", "k"},           {"ɣ", "k"},           {"ç", "k"},           {"ʝ", "k"},           {"ɲ", "k"},
    {"ɟ", "k"},           {"χ", "k"},           {"ʁ", "k"},           {"ʀ", "k"},           {"j\\", "k"},
    {"J\\", "k"},         {"h", "h"},           {"h\\", "h"},         {"?", "h"},           {"ɦ", "h"},
    {"ʔ", "h"},           {"ħ", "h"},           {"ʕ", "h"},           {"w", "w"},           {"W", "w"},
    {"ʍ", "w"},           {"H", "w"},           {"ɥ", "w"},           {"j", "j"},           {"i", "i", true},
    {"I", "i", true},     {"ɪ", "i", true},     {"1", "i", true},     {"ɨ", "i", true},     {"e", "e", true},
    {"E", "e", true},     {"ɛ", "e", true},     {"{", "e", true},     {"æ", "e", true},     {"3", "e", true},
    {"ɜ", "e", true},     {"3`", "r", true},    {"ɝ", "r", true},     {"@`", "r", true},    {"ɚ", "r", true},
    {"a", "a", true},     {"A", "a", true},     {"ɑ", "a", true},     {"V", "a", true},     {"ʌ", "a", true},
    {"6", "a", true},     {"ɐ", "a", true},     {"@", "schwa", true}, {"ə", "schwa", true}, {"@\\", "schwa", true},
    {"ɘ", "schwa", true}, {"o", "o", true},     {"O", "o", true},     {"ɔ", "o", true},     {"Q", "o", true},
    {"ɒ", "o", true},     {"7", "schwa", true}, {"u", "u", true},     {"U", "u", true},     {"ʊ", "u", true},
    {"}", "u", true},     {"ʉ", "u", true},     {"M", "i", true},     {"ɯ", "i", true},     {"y", "y", true},
    {"Y", "y", true},     {"ʏ", "y", true},     {"2", "y", true},     {"ø", "y", true},     {"9", "y", true},
    {"œ", "y", true},     {"8", "y", true},     {"ɵ", "y", true},
};

/// Passed over: they are not seen, or no more than is shown here.
constexpr std::string_view kMarks[] = {
    "\"", "%", "'", ".", "-", "=",  "~",  "|",  " ",  "ˈ",  "ˌ",  "ʰ",  "ʷ",  "ʲ",  "ˠ",  "ˤ",  "˞", "̩",  "̯",  "̃",  "̥",
    "̬",   "̪",  "͡",  "͜",  "̚",  "_h", "_w", "_j", "_}", "_^", "_~", "_=", "_0", "_v", "_d", "_G", "_", "/", "[", "]",
};

constexpr std::string_view kLong[] = {"ː", "ˑ", ":"};

/// ARPAbet; a digit of stress after a vowel is passed over. A diphthong is two phones.
struct Arpabet {
  std::string_view text, first, second;
  bool vowel = false;
};
constexpr Arpabet kArpabet[] = {
    {"AA", "a", "", true},  {"AE", "e", "", true},  {"AH", "a", "", true},
    {"AO", "o", "", true},  {"AW", "a", "u", true}, {"AX", "schwa", "", true},
    {"AXR", "r", "", true}, {"AY", "a", "i", true}, {"EH", "e", "", true},
    {"ER", "r", "", true},  {"EY", "e", "i", true}, {"IH", "i", "", true},
    {"IX", "i", "", true},  {"IY", "i", "", true},  {"OW", "o", "u", true},
    {"OY", "o", "i", true}, {"UH", "u", "", true},  {"UW", "u", "", true},
    {"UX", "y", "", true},  {"B", "p", ""},         {"CH", "sh", ""},
    {"D", "t", ""},         {"DH", "th", ""},       {"DX", "t", ""},
    {"EL", "l", ""},        {"EM", "p", ""},        {"EN", "t", ""},
    {"F", "f", ""},         {"G", "k", ""},         {"HH", "h", ""},
    {"JH", "sh", ""},       {"K", "k", ""},         {"L", "l", ""},
    {"M", "p", ""},         {"N", "t", ""},         {"NG", "k", ""},
    {"P", "p", ""},         {"Q", "h", ""},         {"R", "r", ""},
    {"S", "s", ""},         {"SH", "sh", ""},       {"T", "t", ""},
    {"TH", "th", ""},       {"V", "f", ""},         {"W", "w", ""},
    {"WH", "w", ""},        {"Y", "j", ""},         {"Z", "s", ""},
    {"ZH", "sh", ""},
};

bool begins(std::string_view text, std::string_view with) { return text.substr(0, with.size()) == with; }

/// The longest of `words` that `text` begins with; empty: none.
template <std::size_t N>
std::string_view longest(std::string_view text, const std::string_view (&words)[N]) {
  std::string_view best;
  for (const std::string_view w : words)
    if (w.size() > best.size() && begins(text, w)) best = w;
  return best;
}

/// The phones of an ARPAbet text; nothing if some word of it is none, or if none has two letters: then it may as well
/// be X-SAMPA.
std::optional<std::vector<Phone>> read_arpabet(std::string_view text) {
  std::vector<Phone> out;
  bool two_letters = false;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == ' ') {
      ++at;
      continue;
    }
    std::size_t end = text.find(' ', at);
    if (end == std::string_view::npos) end = text.size();
    std::string_view word = text.substr(at, end - at);
    const std::string_view written = word;
    at = end;
    const bool stress = word.size() > 1 && word.back() >= '0' && word.back() <= '2';
    if (stress) word.remove_suffix(1);
    const Arpabet* found = nullptr;
    for (const Arpabet& a : kArpabet)
      if (a.text == word) found = &a;
    if (found == nullptr || (stress && !found->vowel)) return std::nullopt;
    two_letters = two_letters || word.size() > 1;
    const std::int64_t length = found->vowel ? kVowelNs : kConsonantNs;
    out.push_back({found->first, found->second.empty() ? length : kConsonantNs, written});
    if (!found->second.empty()) out.push_back({found->second, kConsonantNs, written});
  }
  if (!two_letters) return std::nullopt;
  return out;
}

}  // namespace

std::optional<std::vector<Phone>> read_phones(std::string_view text, UnreadPhone& unread) {
  if (auto arpabet = read_arpabet(text)) return arpabet;
  std::vector<Phone> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view rest = text.substr(at);
    const Symbol* found = nullptr;
    for (const Symbol& s : kSymbols)
      if (begins(rest, s.text) && (found == nullptr || s.text.size() > found->text.size())) found = &s;
    if (found != nullptr) {
      out.push_back({found->viseme, found->vowel ? kVowelNs : kConsonantNs, rest.substr(0, found->text.size())});
      at += found->text.size();
    } else if (const std::string_view length = longest(rest, kLong); !length.empty() && !out.empty()) {
      out.back().duration_ns += out.back().duration_ns / 2;
      at += length.size();
    } else if (const std::string_view mark = longest(rest, kMarks); !mark.empty()) {
      at += mark.size();
    } else {
      std::size_t size = 1;  // the whole of a UTF-8 character
      while (size < rest.size() && (static_cast<unsigned char>(rest[size]) & 0xC0U) == 0x80U) ++size;
      unread = {at, size};
      return std::nullopt;
    }
  }
  if (out.empty()) {
    unread = {0, text.size()};
    return std::nullopt;
  }
  return out;
}

}  // namespace nms::compiler
