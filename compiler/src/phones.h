#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace nms::compiler {

/// One sound of a spoken word, as far as it is seen on a mouth.
struct Phone {
  std::string_view viseme;       ///< the pose `viseme_NAME` that is its shape
  std::int64_t duration_ns = 0;  ///< where nothing stretches it
  std::string_view symbol;       ///< as it is written, in the text that was read
};

/// Where a text ceased to be phones.
struct UnreadPhone {
  std::size_t at = 0;  ///< bytes from the text's start
  std::size_t length = 0;
};

/// A word in IPA or X-SAMPA (of which one text may have both, and SiGML's `t_S`), or in ARPAbet, blanks between its
/// symbols, of which one at least has two letters. Marks of stress, tone, syllables and secondary articulation are
/// passed over; a mark of length makes its phone longer by half.
/// @return its phones, which name parts of `text`; or nothing, and where the first that is none stands
[[nodiscard]] std::optional<std::vector<Phone>> read_phones(std::string_view text, UnreadPhone& unread);

}  // namespace nms::compiler
