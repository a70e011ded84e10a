#include "dependency_file.h"

#include <string_view>

namespace nms::cli {
namespace {

std::string escaped(std::string_view path) {
  std::string out;
  for (const char c : path) {
    if (c == ' ' || c == '#') out += '\\';
    if (c == '$') out += '$';
    out += c;
  }
  return out;
}

}  // namespace

std::string dependency_rule(const std::string& target, const std::vector<std::string>& dependencies) {
  std::string out = escaped(target) + ":";
  for (const std::string& d : dependencies) out += " \\\n  " + escaped(d);
  return out + "\n";
}

}  // namespace nms::cli
