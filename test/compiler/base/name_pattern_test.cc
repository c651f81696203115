#include "compiler/base/name_pattern.h"

#include <gtest/gtest.h>

namespace morphbus {
namespace {

TEST(NamePattern, AsksForWholeNames) {
  const Result<NamePattern> pattern = NamePattern::Parse("walk/m[12]/.*");
  ASSERT_TRUE(pattern) << pattern.error().message;
  EXPECT_TRUE(pattern->Matches("walk/m1/TRANSFORM"));
  EXPECT_FALSE(pattern->Matches("walk/m3/TRANSFORM"));
  // A part of a name is not enough, at either end.
  EXPECT_FALSE(pattern->Matches("a/walk/m1/TRANSFORM"));
  EXPECT_FALSE(NamePattern::Parse("walk")->Matches("walk/m1"));
}

TEST(NamePattern, EmptyMeansEveryName) {
  EXPECT_TRUE(NamePattern::Parse("")->Matches("walk/m1/TRANSFORM"));
  EXPECT_TRUE(NamePattern::Parse("")->Matches(""));
}

TEST(NamePattern, SaysWhatIsNoExpression) {
  const Result<NamePattern> pattern = NamePattern::Parse("(");
  ASSERT_FALSE(pattern);
  EXPECT_NE(pattern.error().message.find("'(' is no regular expression"), std::string::npos);
}

}  // namespace
}  // namespace morphbus
