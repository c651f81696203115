#include "logger/compare/tolerances.h"

#include <gtest/gtest.h>

#include <numbers>

namespace morphbus::logger {
namespace {

constexpr double kDegreeRad = std::numbers::pi / 180;

TEST(Tolerances, AreReadInTheUnitsOfTheirNames) {
  EXPECT_EQ(ReadTolerance("angle_rad", "0.01").value(), 0.01);
  EXPECT_EQ(ReadTolerance("angle_rad", "1deg").value(), kDegreeRad);
  EXPECT_EQ(ReadTolerance("cycle_s", "100ms").value(), 0.1);
  EXPECT_EQ(ReadTolerance("duty", "5%").value(), 0.05);
  EXPECT_EQ(ReadTolerance("simulated_m", "0.005").value(), 0.005);
  // A cost of transport may be anything.
  EXPECT_EQ(ReadTolerance("transport", "3").value(), 3.0);
}

TEST(Tolerances, HaveNoOtherUnits) {
  for (const auto& [name, text] :
       {std::pair("angle_rad", "1ms"), std::pair("cycle_s", "1deg"), std::pair("simulated_m", "1s"),
        std::pair("velocity_rad_s", "1s"), std::pair("velocity_m_s", "1s"),
        std::pair("angle_rad", "-1deg"), std::pair("angle_rad", "")}) {
    EXPECT_FALSE(ReadTolerance(name, text)) << name << "=" << text;
  }
}

TEST(Tolerances, EveryNameReadsAPlainNumber) {
  for (const auto& [name, member] : ToleranceNames())
    EXPECT_TRUE(ReadTolerance(name, "0.5")) << name;
}

TEST(Tolerances, FilesHaveUnitsInTexts) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("t.toml",
                                   "angle_rad = \"1deg\"\n"
                                   "cycle_s = 1\n"
                                   "[role.\"*\"]\n"
                                   "event_s = \"50ms\"\n");
  const std::vector<ToleranceEntry> entries = ParseTolerances(sources, file, &diagnostics);
  EXPECT_EQ(Render(diagnostics, sources, false), "");
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].value, kDegreeRad);
  EXPECT_EQ(entries[1].value, 1.0);
  EXPECT_EQ(entries[2].value, 0.05);
}

TEST(Tolerances, WhatIsNoNumberHasItsPlace) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("t.toml", "cycle_s = \"1deg\"\nduty = -1\ndrift_m = [1]\n");
  ParseTolerances(sources, file, &diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 3u);
  EXPECT_EQ(diagnostics.all()[0].message, "expected a time, 0 or more, such as 0.1 or 100ms");
  // In the order of the text: duty is the second.
  EXPECT_EQ(sources.Locate(file, diagnostics.all()[1].span.begin).line, 2);
}

}  // namespace
}  // namespace morphbus::logger
