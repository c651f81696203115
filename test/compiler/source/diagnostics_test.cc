#include "compiler/source/diagnostics.h"

#include <gtest/gtest.h>

namespace morphbus::source {
namespace {

TEST(DiagnosticsTest, WarningsAreNoErrors) {
  Diagnostics diagnostics;
  diagnostics.Warning({}, "hm");
  EXPECT_FALSE(diagnostics.had_errors());
  diagnostics.Error({}, "no");
  EXPECT_TRUE(diagnostics.had_errors());
}

TEST(DiagnosticsTest, ErrorsBeyondTheMostAreCountedButNotKept) {
  Diagnostics diagnostics;
  for (size_t i = 0; i < 10'000; ++i) {
    diagnostics.Error({0, i, i + 1}, "no").notes.push_back({{}, "note"});
  }
  EXPECT_TRUE(diagnostics.full());
  EXPECT_EQ(diagnostics.error_count(), 10'000);
  ASSERT_EQ(diagnostics.all().size(), size_t{Diagnostics::kMaxErrors} + 1);
  EXPECT_EQ(diagnostics.all().back().message, "too many errors, no more are shown");
}

TEST(DiagnosticsTest, AnErrorAtOnePlaceIsKeptOnceAndCountedEachTime) {
  Diagnostics diagnostics;
  for (int i = 0; i < 8; ++i) diagnostics.Error({0, 5, 9}, "no").notes.push_back({{}, "note"});
  diagnostics.Error({0, 5, 9}, "nor that");
  diagnostics.Error({0, 6, 9}, "no");
  EXPECT_EQ(diagnostics.error_count(), 10);
  ASSERT_EQ(diagnostics.all().size(), 3u);
  EXPECT_EQ(diagnostics.all()[0].notes.size(), 1u);
}

TEST(DiagnosticsTest, RenderShowsPlaceLineAndCaret) {
  SourceSet set;
  const int file = set.AddText("a.m3l", "module A:\npoint c1: cords=(1,2,3)\n");
  Diagnostics diagnostics;
  Diagnostic& d = diagnostics.Error({file, 20, 25}, "point 'c1' has no coords");
  d.hint = "did you mean 'coords'?";
  d.notes.push_back({{file, 7, 8}, "in this module"});
  EXPECT_EQ(Render(diagnostics, set, false),
            "a.m3l:2:11: error: point 'c1' has no coords\n"
            "  point c1: cords=(1,2,3)\n"
            "            ^~~~~\n"
            "  hint: did you mean 'coords'?\n"
            "a.m3l:1:8: note: in this module\n"
            "  module A:\n"
            "         ^\n");
}

TEST(DiagnosticsTest, RenderSortsByPlace) {
  SourceSet set;
  const int file = set.AddText("a", "x\ny\n");
  Diagnostics diagnostics;
  diagnostics.Error({file, 2, 3}, "second");
  diagnostics.Warning({file, 0, 1}, "first");
  const std::string text = Render(diagnostics, set, false);
  EXPECT_LT(text.find("first"), text.find("second"));
}

TEST(DiagnosticsTest, TheCaretStaysAlignedAfterTabsAndWideCharacters) {
  SourceSet set;
  const int file = set.AddText("a", "\t\xC3\xA9 x");
  Diagnostics diagnostics;
  diagnostics.Error({file, 4, 5}, "here");
  EXPECT_NE(Render(diagnostics, set, false).find("\n  \t  ^\n"), std::string::npos);
}

TEST(DiagnosticsTest, LongLinesAreCutAroundTheSpan) {
  SourceSet set;
  const int file = set.AddText("a", std::string(1'000'000, 'x') + "!" + std::string(1000, 'y'));
  Diagnostics diagnostics;
  diagnostics.Error({file, 1'000'000, 1'000'001}, "here");
  const std::string text = Render(diagnostics, set, false);
  EXPECT_LT(text.size(), 500U);
  EXPECT_NE(text.find("xx!yy"), std::string::npos);
}

TEST(DiagnosticsTest, ControlCharactersDoNotReachTheTerminal) {
  SourceSet set;
  const int file = set.AddText("a", std::string("\x1b[2J\0z", 6));
  Diagnostics diagnostics;
  diagnostics.Error({file, 0, 1}, "here");
  const std::string text = Render(diagnostics, set, false);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\0'), std::string::npos);
}

TEST(DiagnosticsTest, ColorsOnlyWhenAsked) {
  SourceSet set;
  const int file = set.AddText("a", "x");
  Diagnostics diagnostics;
  diagnostics.Error({file, 0, 1}, "here");
  EXPECT_EQ(Render(diagnostics, set, false).find('\033'), std::string::npos);
  EXPECT_NE(Render(diagnostics, set, true).find("\033[1;31m"), std::string::npos);
}

TEST(DiagnosticsTest, SpansOutsideTheTextAreHarmless) {
  SourceSet set;
  const int file = set.AddText("a", "x");
  Diagnostics diagnostics;
  diagnostics.Error({file, 50, 60}, "past the end");
  diagnostics.Error({7, 0, 1}, "no such file");
  EXPECT_NE(Render(diagnostics, set, false).find("error: no such file"), std::string::npos);
}

TEST(NearestNameTest, FindsLikelySlips) {
  EXPECT_EQ(NearestName("cords", {"connector", "coords"}), "coords");
  EXPECT_EQ(NearestName("grouipng", {"hull", "grouping"}), "grouping");
  EXPECT_EQ(NearestName("c7", {"m1", "c1", "c2"}), "c1");
}

TEST(NearestNameTest, KeepsSilentWhenNothingIsNear) {
  EXPECT_EQ(NearestName("wheel", {"coords", "hull"}), "");
  EXPECT_EQ(NearestName("x", {"y"}), "");
  EXPECT_EQ(NearestName("", {"y"}), "");
  EXPECT_EQ(NearestName(std::string(1000, 'a'), {std::string(1000, 'a') + "b"}), "");
}

}  // namespace
}  // namespace morphbus::source
