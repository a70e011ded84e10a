#include <nms/lang/quantity.h>

#include <string>

#include <gtest/gtest.h>

namespace nms::lang {
namespace {

TEST(Quantity, reads_every_unit) {
  EXPECT_EQ(read_quantity("60%")->value, 0.6);
  EXPECT_EQ(read_quantity("33.3%")->value, 0.333);
  EXPECT_EQ(read_quantity("250ms")->value, 0.25);
  EXPECT_EQ(read_quantity("2.34s")->value, 2.34);
  EXPECT_EQ(read_quantity("10us")->value, 1e-5);
  EXPECT_EQ(read_quantity("15deg")->unit, Unit::angle);
  EXPECT_EQ(read_quantity("2Hz")->unit, Unit::frequency);
  EXPECT_EQ(read_quantity("3x")->unit, Unit::count);
  EXPECT_EQ(read_quantity("8mm")->value, 8.0);
  EXPECT_EQ(read_quantity("1.5cm")->value, 15.0);
  EXPECT_EQ(read_quantity("0.5")->unit, Unit::none);
  EXPECT_EQ(read_quantity("-200ms")->value, -0.2);
}

TEST(Quantity, times_are_whole_nanoseconds) {
  EXPECT_EQ(read_quantity("2.34s")->nanoseconds, 2'340'000'000);
  EXPECT_EQ(read_quantity("-0.1ms")->nanoseconds, -100'000);
  EXPECT_EQ(read_quantity("0.0005us")->nanoseconds, 1);
  EXPECT_EQ(read_quantity("0.00049us")->nanoseconds, 0);
  EXPECT_EQ(read_quantity("-0.0005us")->nanoseconds, -1);
  EXPECT_EQ(read_quantity("1000000s")->nanoseconds, 1'000'000'000'000'000);
  EXPECT_EQ(read_quantity("0.3333333333333333333333333333s")->nanoseconds, 333'333'333);
}

TEST(Quantity, long_numbers_round_once) {
  EXPECT_EQ(read_quantity("0.1000000000000000055511151231257827")->value, 0.1);
  EXPECT_EQ(read_quantity("12.34567890123456789012%")->value, 0.1234567890123456789012);
  EXPECT_EQ(read_quantity(std::string(400, '0') + "7")->value, 7.0);
}

// A sign sends a number round the ways of its own that the commonest forms have.
TEST(Quantity, short_forms_come_to_the_same) {
  for (const char* unit : {"%", "s", "ms"})
    for (const char* number : {"0", "7", "60", "100", "0.1", "2.4", "0.07", "9.999", "123456", "1234.5", "0.00001",
                               ".5", "5.", "1.2.3", "", ".", "1s", "1 "}) {
      const std::string text = std::string(number) + unit;
      const auto plain = read_quantity(text);
      const auto with_sign = read_quantity("+" + text);
      ASSERT_EQ(plain.has_value(), with_sign.has_value()) << text;
      if (!plain) continue;
      EXPECT_EQ(plain->value, with_sign->value) << text;
      EXPECT_EQ(plain->unit, with_sign->unit) << text;
      EXPECT_EQ(plain->nanoseconds, with_sign->nanoseconds) << text;
    }
}

TEST(Quantity, nothing_for_anything_else) {
  for (std::string_view t : {"", "-", "s", ".5", "1.", "1..2", "1.2.3", "5 s", "5S", "5sec", "--5", "1e5", "5%%",
                             "1000000.1s", "1000000001", "99999999999999999999999999999999x", "1100000000ms"})
    EXPECT_FALSE(read_quantity(t).has_value()) << t;
}

}  // namespace
}  // namespace nms::lang
