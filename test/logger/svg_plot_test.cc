#include "logger/show/svg_plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace morphbus::logger {
namespace {

/// A long line at height 1 with one peak, whose values before `begin` are missing.
std::string LineFrom(size_t begin) {
  PlotLine line{"", "line", {}};
  for (size_t i = 0; i < 60'000; ++i) {
    const double y = i < begin ? std::nan("") : i == 50 || i == 30'050 ? 7.0 : 1.0;
    line.points.emplace_back(static_cast<double>(i), y);
  }
  return PlotSvg({line}, {.title = "t", .y_label = "y"});
}

/// The path of the line in a plot.
std::string PathOf(const std::string& svg) {
  const size_t begin = svg.find("<path class='line' d='");
  return svg.substr(begin, svg.find("'/>", begin) - begin);
}

TEST(SvgPlotTest, ThinningKeepsPeaksAlsoWhereTheFirstValueIsMissing) {
  for (const size_t begin : {0, 1, 30, 30'001}) {
    const std::string path = PathOf(LineFrom(begin));
    // The highest point of the plot lies near its upper border.
    const double top = std::stod(path.substr(path.find(' ', path.find("M")) + 1));
    double highest = top;
    for (size_t at = path.find(' ', path.find("M")); at != std::string::npos;
         at = path.find(' ', at + 1)) {
      highest = std::min(highest, std::stod(path.substr(at + 1)));
    }
    EXPECT_LT(highest, 50.0) << begin;
    EXPECT_EQ(path.find("nan"), std::string::npos);
  }
}

TEST(SvgPlotTest, AValueThatIsMissingBreaksALongLineToo) {
  PlotLine line{"", "line", {}};
  for (int i = 0; i < 60'000; ++i) line.points.emplace_back(i, i == 30'050 ? std::nan("") : 1.0);
  const std::string path = PathOf(PlotSvg({line}, {}));
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
}

}  // namespace
}  // namespace morphbus::logger
