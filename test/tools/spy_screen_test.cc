// Texts and figures of a terminal's cells: cut, shortened, as trends and meters.

#include "tools/spy/screen.h"

#include <gtest/gtest.h>

#include <cmath>

namespace morphbus::tools {
namespace {

TEST(SpyScreenTest, TextsAreCutByCells) {
  EXPECT_EQ(FitCells("abc", 5), "abc  ");
  EXPECT_EQ(FitCells("abc", 5, true), "  abc");
  EXPECT_EQ(FitCells("äöüß", 3), "äö…");
  EXPECT_EQ(FitCells("abc", 0), "");
  EXPECT_EQ(FitEnd("one.two.three", 6), "…three");
  EXPECT_EQ(ToAscii("12µs ×1 ▁█ ä…"), "12us x1 _# ?~");
}

TEST(SpyScreenTest, FiguresTakeFewCells) {
  for (double value = 1e-9; value < 1e12; value *= 1.37) {
    EXPECT_LE(Cells(ShortTime(value)), 6 + (value > 3e8 ? 8 : 0)) << value;
    EXPECT_LE(Cells(ShortBytes(value)), 6 + (value > 9e11 ? 8 : 0)) << value;
    EXPECT_LE(Cells(ShortRate(value)), 6 + (value > 9e7 ? 12 : 0)) << value;
    EXPECT_LE(Cells(ShortCount(static_cast<int64_t>(value))), 7) << value;
  }
  EXPECT_EQ(ShortTime(12e-6), "12µs");
  EXPECT_EQ(ShortTime(3.45e-3), "3.45ms");
  EXPECT_EQ(ShortTime(0.12), "120ms");
  EXPECT_EQ(ShortCount(1'230'000), "1.23M");
  EXPECT_EQ(ShortBytes(5100), "5.1k");
}

TEST(SpyScreenTest, TrendsBeginAtZeroAndMetersFillTheirShare) {
  EXPECT_EQ(SparklineFromZero({8, 4, 0, 8, 1}, 4), "▄ █▁");
  EXPECT_EQ(SparklineFromZero({0, 0}, 8), "  ");
  EXPECT_EQ(SparklineFromZero({}, 8), "");
  EXPECT_EQ(Meter(0.5, 4), "██");
  EXPECT_EQ(Meter(0.28125, 4), "█▏");
  EXPECT_EQ(Meter(7.0, 3), "███");
  EXPECT_EQ(Meter(0.0, 3), "");
  EXPECT_EQ(ToAscii("█▏█▌"), "#-#=");
}

TEST(SpyScreenTest, SparklinesGoFromTheLeastToTheGreatest) {
  EXPECT_EQ(Sparkline({0, 1, 2, 3, 4, 5, 6, 7}, 8), "▁▂▃▄▅▆▇█");
  EXPECT_EQ(Sparkline({5, 0, 7}, 2), "▁█");
  EXPECT_EQ(Sparkline({3, 3}, 8), "▁▁");
  EXPECT_EQ(Sparkline({-1e308, 1e308, INFINITY, NAN}, 8), "▁█  ");
  EXPECT_EQ(Sparkline({1}, 0), "");
}

}  // namespace
}  // namespace morphbus::tools
