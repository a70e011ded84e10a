#include "json_text.h"

#include <string>

#include <gtest/gtest.h>

namespace nms::runtime {
namespace {

constexpr const char* kText = R"( {"a" : [1, "x]\\", {"b":[ ]} ], "c":{ }, "\u0064":-1.50e+3 ,"a2":[]  } tail)";

std::string at(const std::string& text, TextSpan span) { return std::string(span.of(text)); }

TEST(JsonText, spans_are_what_is_written) {
  const std::string text = kText;
  const TextSpan root = json_value(text, 0);
  const auto members = json_members(text, root);
  ASSERT_EQ(members.size(), 4U);
  EXPECT_EQ(at(text, members[0].key), "a");
  EXPECT_EQ(at(text, members[0].value), R"([1, "x]\\", {"b":[ ]} ])");
  EXPECT_EQ(at(text, members[1].whole()), R"("c":{ })");
  EXPECT_EQ(at(text, json_member(text, root, "d")), "-1.50e+3") << "a key with escapes";
  EXPECT_TRUE(json_member(text, root, "b").empty());
  const auto elements = json_elements(text, members[0].value);
  ASSERT_EQ(elements.size(), 3U);
  EXPECT_EQ(at(text, elements[1]), R"("x]\\")");
  EXPECT_EQ(at(text, elements[2]), R"({"b":[ ]})");
  EXPECT_TRUE(json_members(text, elements[0]).empty());
}

TEST(JsonText, edits_leave_all_else_as_it_is) {
  const std::string text = kText;
  JsonEdit edit(text);
  edit.append(json_member(text, edit.root(), "a"), {"2", "3"});
  edit.append(json_member(text, edit.root(), "a2"), {"4"});
  edit.append(json_member(text, edit.root(), "c"), {R"("e":5)"});
  edit.replace(json_member(text, edit.root(), "d"), "6");
  edit.append(edit.root(), {R"("f":7)"});
  EXPECT_EQ(edit.done(), R"({"a" : [1, "x]\\", {"b":[ ]},2,3 ], "c":{"e":5 }, "\u0064":6 ,"a2":[4],"f":7  })");
}

TEST(JsonText, what_is_broken_ends) {
  const std::string whole = kText;
  for (std::size_t cut = 0; cut < whole.size(); ++cut)
    for (const char sign : {'{', '}', '[', ']', '"', ',', ':', '\\', ' '}) {
      const std::string text = whole.substr(0, cut) + sign;
      const TextSpan root = json_value(text, 0);
      EXPECT_LE(root.end, text.size());
      for (const JsonMember& m : json_members(text, root)) {
        EXPECT_LE(m.value.end, text.size());
        for (const TextSpan e : json_elements(text, m.value)) EXPECT_LE(e.end, text.size());
      }
    }
}

}  // namespace
}  // namespace nms::runtime
