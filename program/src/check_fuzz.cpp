#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <nms/program/evaluate.h>
#include <nms/program/play.h>
#include <nms/program/text.h>

#include "container.h"
#include "test_programs.h"

namespace {

using namespace nms::program;

void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// Whatever passes the checks can be played, and its text leads back to it.
void use(std::span<const std::byte> bytes) {
  const auto image = Image::load(bytes, "fuzz");
  if (!image) {
    return;
  }
  const Program& program = image->program();
  exercise(program);
  const std::string text = to_text(program);
  const auto draft = from_text(text, "fuzz");
  require(draft.has_value());
  const auto again = Image::from(*draft);
  require(again.has_value());
  require(to_text(again->program()) == text);
  const auto third = from_text(to_text(again->program()), "fuzz");
  require(third.has_value() && encode(*third) == encode(*draft));

  std::vector<float> here(program.channels.size());
  std::vector<float> there(program.channels.size());
  for (std::size_t c = 0; c < program.clips.size(); ++c) {
    Player player(program, program.clips[c]);
    for (const Knot& knot : program.knots) {
      evaluate(program, program.clips[c], knot.time_ns() + 1, here);
      player.advance(knot.time_ns() + 1, there);
      require(here.empty() || std::memcmp(here.data(), there.data(), here.size() * sizeof(float)) == 0);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::byte> bytes(size);
  if (size > 0) {
    std::memcpy(bytes.data(), data, size);
  }
  use(bytes);
  // Nobody guesses a checksum, a size or a mark: put them right, and look behind them.
  if (size >= sizeof(Header)) {
    std::memcpy(bytes.data(), kMagic.data(), kMagic.size());
    const std::uint64_t whole = size;
    std::memcpy(bytes.data() + offsetof(Header, size), &whole, sizeof(whole));
    reseal(bytes);
    use(bytes);
  }
  return 0;
}
