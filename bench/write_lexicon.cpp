// The input of lexicon_assets.sh, on stdout.
#include <cstdio>

#include "lexicon_text.h"

int main() {
  const std::string text = nms::bench::lexicon_text();
  return std::fwrite(text.data(), 1, text.size(), stdout) == text.size() ? 0 : 1;
}
