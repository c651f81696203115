#include "compiler/base/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace morphbus {
namespace {

TEST(Utf8Test, CharactersOfEveryLengthAreUtf8) {
  EXPECT_TRUE(IsUtf8(""));
  EXPECT_TRUE(IsUtf8("a\xC3\xA9\xE2\x82\xAC\xF0\x9F\xA4\x96"));
  EXPECT_TRUE(IsUtf8("\xED\x9F\xBF\xEE\x80\x80\xF4\x8F\xBF\xBF"));
  EXPECT_TRUE(IsUtf8(std::string(1, '\0')));
  EXPECT_EQ(Utf8Length("\xE2\x82\xAC", 0), 3U);
}

TEST(Utf8Test, EverythingElseIsNot) {
  for (const char* bad : {"\xE9", "\x80", "\xC3", "\xE2\x82", "\xF0\x9F\xA4", "\xC3(", "\xFF",
                          "\xC0\x80", "\xC1\xBF", "\xE0\x80\x80", "\xF0\x80\x80\x80",  // Overlong.
                          "\xED\xA0\x80", "\xED\xBF\xBF",  // Surrogates.
                          "\xF4\x90\x80\x80", "\xF8\x88\x80\x80\x80"}) {
    EXPECT_FALSE(IsUtf8(bad)) << bad;
    EXPECT_EQ(Utf8Length(bad, 0), 0U) << bad;
  }
}

TEST(Utf8Test, CodePointsComeFromFormsOfEveryLength) {
  EXPECT_EQ(Utf8Code("a", 0), 0x61U);
  EXPECT_EQ(Utf8Code("\xC3\xA9", 0), 0xE9U);
  EXPECT_EQ(Utf8Code("a\xE2\x82\xAC", 1), 0x20ACU);
  EXPECT_EQ(Utf8Code("\xF0\x9F\xA4\x96", 0), 0x1F916U);
}

}  // namespace
}  // namespace morphbus
