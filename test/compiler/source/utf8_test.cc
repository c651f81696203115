#include "compiler/source/diagnostics.h"

#include <gtest/gtest.h>

namespace morphbus::source {
namespace {

TEST(Utf8Test, AFileGetsOneErrorAtTheFirstBadByte) {
  SourceSet sources;
  Diagnostics diagnostics;
  CheckUtf8(sources, sources.AddText("good", "a\xC3\xA9"), &diagnostics);
  EXPECT_FALSE(diagnostics.had_errors());
  CheckUtf8(sources, sources.AddText("bad", "caf\xE9 \xE9t\xE9\n"), &diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 1U);
  EXPECT_EQ(diagnostics.all()[0].message, "byte \\xe9 is not UTF-8, nor are others");
  EXPECT_EQ(Render(diagnostics, sources, false),
            "bad:1:4: error: byte \\xe9 is not UTF-8, nor are others\n"
            "  caf? ?t?\n"
            "     ^\n"
            "  hint: save the file as UTF-8\n");
}

}  // namespace
}  // namespace morphbus::source
