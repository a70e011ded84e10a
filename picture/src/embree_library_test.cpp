#include "embree_library.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace nms::picture {
namespace {

// What the room promises: who does not draw does not load it. The first test of the program, since those that draw do.
TEST(EmbreeLibrary, is_not_mapped_before_it_is_asked_for) {
  const auto mapped = [] {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);)
      if (line.find("libembree") != std::string::npos) return true;
    return false;
  };
  if (!std::ifstream("/proc/self/maps")) GTEST_SKIP() << "no /proc/self/maps here";
  EXPECT_FALSE(mapped());
  ASSERT_TRUE(embree().has_value());
  EXPECT_TRUE(mapped());
}

TEST(EmbreeLibrary, the_one_that_it_was_built_with_has_all_functions) {
  const auto& library = embree();
  ASSERT_TRUE(library.has_value()) << library.error().cause;
#define NMS_X(function) EXPECT_NE(library->function, nullptr) << #function;
  NMS_EMBREE_FUNCTIONS(NMS_X)
#undef NMS_X
}

TEST(EmbreeLibrary, one_that_is_not_there_is_a_failure_with_a_remedy) {
  const auto library = open_embree("libno_such_embree.so.3");
  ASSERT_FALSE(library.has_value());
  EXPECT_NE(library.error().cause.find("libno_such_embree.so.3"), std::string::npos) << library.error().cause;
  EXPECT_NE(library.error().remedy.find("install Embree 3"), std::string::npos);
}

TEST(EmbreeLibrary, another_library_is_a_failure_that_names_what_it_lacks) {
  const auto library = open_embree("libc.so.6");
  ASSERT_FALSE(library.has_value());
  EXPECT_NE(library.error().cause.find("rtcNewDevice"), std::string::npos) << library.error().cause;
}

}  // namespace
}  // namespace nms::picture
