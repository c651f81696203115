#include "compiler/base/text.h"

#include <gtest/gtest.h>

namespace morphbus {
namespace {

TEST(TextTest, OneIsSingularAndAllElseIsPlural) {
  EXPECT_EQ(Counted(0, "fault"), "0 faults");
  EXPECT_EQ(Counted(1, "fault"), "1 fault");
  EXPECT_EQ(Counted(2, "fault"), "2 faults");
  EXPECT_EQ(Counted(1, "body", "bodies"), "1 body");
  EXPECT_EQ(Counted(2, "body", "bodies"), "2 bodies");
}

TEST(TextTest, OfManyNamesTheFirstAreNamedAndTheOthersCounted) {
  EXPECT_EQ(NameFirst({}, 2), "");
  EXPECT_EQ(NameFirst({"a"}, 2), "a");
  EXPECT_EQ(NameFirst({"a", "b"}, 2), "a, b");
  EXPECT_EQ(NameFirst({"a", "b", "c"}, 2), "a, b and 1 more");
}

TEST(TextTest, HashesHaveAllTheirDigits) {
  EXPECT_EQ(Hex(0xABC), "0000000000000abc");
  EXPECT_EQ(Hex(~uint64_t{0}), "ffffffffffffffff");
  EXPECT_EQ(Hex(0x1b, 2), "1b");
  EXPECT_EQ(Hex(0x12345, 4), "12345");
}

TEST(TextTest, MicrosecondsAreShownAsSeconds) {
  EXPECT_DOUBLE_EQ(Seconds(12'500'000), 12.5);
  EXPECT_DOUBLE_EQ(Seconds(-1), -1e-6);
}

TEST(EscapeControlTest, PrintableTextStaysAsItIs) {
  const std::string text = "m1/STATUS \"caf\xC3\xA9\" \\ \xE2\x82\xAC \xF0\x9F\xA4\x96";
  EXPECT_EQ(EscapeControl(text), text);
  EXPECT_EQ(EscapeControl(""), "");
}

TEST(EscapeControlTest, ControlCharactersBecomeVisible) {
  EXPECT_EQ(EscapeControl("\x1b[2J\a"), "\\x1b[2J\\x07");
  EXPECT_EQ(EscapeControl("a\nb\rc\td"), "a\\nb\\rc\\td");
  EXPECT_EQ(EscapeControl(std::string_view("\0\x7f", 2)), "\\x00\\x7f");
  for (int c = 0; c < 0x20; ++c) {
    EXPECT_EQ(EscapeControl(std::string(1, static_cast<char>(c))).front(), '\\') << c;
  }
}

TEST(EscapeControlTest, ControlsBeyondAsciiBecomeVisible) {
  EXPECT_EQ(EscapeControl("\xC2\x9B"
                          "31m"),
            "\\u009b31m");  // CSI as one C1 character.
  EXPECT_EQ(EscapeControl("\xC2\x80 \xC2\x9F \xC2\xA0"), "\\u0080 \\u009f \xC2\xA0");
  EXPECT_EQ(EscapeControl("a\xE2\x80\xAE"
                          "b"),
            "a\\u202eb");  // Right-to-left override.
  EXPECT_EQ(EscapeControl("a\xE2\x80\xA8"
                          "b"),
            "a\\u2028b");  // Line separator.
}

TEST(EscapeControlTest, BytesThatAreNotUtf8BecomeVisible) {
  EXPECT_EQ(EscapeControl("\x9b"
                          "31m"),
            "\\x9b31m");  // A bare C1 byte.
  EXPECT_EQ(EscapeControl("caf\xE9"), "caf\\xe9");
  EXPECT_EQ(EscapeControl("\xE2\x82"), "\\xe2\\x82");
}

}  // namespace
}  // namespace morphbus
