// What a sweep is before anything runs: its values, its points and its expressions.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tools/sweep/axis_reader.h"
#include "tools/sweep/sampling.h"

namespace morphbus::tools {
namespace {

constexpr const char* kRun = "model = 'm'\nprogram = 'p'\nseconds = 1\n";

/// The points of a file that is good.
std::vector<RunPoint> PointsIn(const std::string& text,
                               const std::vector<std::string>& words = {}) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("s.toml", kRun + text);
  const auto sweep = ReadSweepFile(&sources, file, "folder/s.toml", words, &diagnostics);
  EXPECT_TRUE(sweep) << source::Render(diagnostics, sources, false);
  return sweep ? PointsOf(*sweep).value_or(std::vector<RunPoint>()) : std::vector<RunPoint>();
}

/// The values of one name in all points.
std::vector<double> NumbersOf(const std::vector<RunPoint>& points, const std::string& name) {
  std::vector<double> numbers;
  for (const RunPoint& point : points) numbers.push_back(point[name].get<double>());
  return numbers;
}

TEST(StepsTest, DecimalStepsAreTheDecimalNumbers) {
  EXPECT_EQ(Steps(0.1, 0.1, 3), (std::vector<double>{0.1, 0.2, 0.3}));
  EXPECT_EQ(Steps(10, 5, 3), (std::vector<double>{10, 15, 20}));
  EXPECT_EQ(Steps(-0.02, 0.01, 4), (std::vector<double>{-0.02, -0.01, 0, 0.01}));
  // No decimal number: plain sums.
  EXPECT_EQ(Steps(1.0 / 3, 1, 2), (std::vector<double>{1.0 / 3, 1.0 / 3 + 1}));
}

TEST(SweepTest, TheLastAxisChangesFastest) {
  const auto points = PointsIn("friction = [0.4, 0.8]\nseeds = {from = 1, to = 3, step = 1}\n");
  EXPECT_EQ(NumbersOf(points, "friction"), (std::vector<double>{0.4, 0.4, 0.4, 0.8, 0.8, 0.8}));
  EXPECT_EQ(NumbersOf(points, "seed"), (std::vector<double>{1, 2, 3, 1, 2, 3}));
  EXPECT_TRUE(points[0]["seed"].is_number_integer());
}

TEST(SweepTest, TheEndOfARangeIsInIt) {
  EXPECT_EQ(NumbersOf(PointsIn("friction = {from = 0.1, to = 0.7, step = 0.2}\n"), "friction"),
            (std::vector<double>{0.1, 0.3, 0.5, 0.7}));
  EXPECT_EQ(
      NumbersOf(PointsIn("friction = {from = 0.01, to = 1, count = 3, log = true}\n"), "friction"),
      (std::vector<double>{0.01, 0.1, 1}));
}

TEST(SweepTest, EachPartOfALatinHypercubeHasOneSample) {
  const auto points = PointsIn(
      "method = 'latin'\nsamples = 10\nfriction = {from = 0, to = 1}\nset.a = {from = 0, to = "
      "10}\n");
  ASSERT_EQ(points.size(), 10u);
  std::set<int> friction, a;
  for (const RunPoint& point : points) {
    friction.insert(static_cast<int>(point["friction"].get<double>() * 10));
    a.insert(static_cast<int>(point["a"].get<double>()));
  }
  EXPECT_EQ(friction.size(), 10u);
  EXPECT_EQ(a.size(), 10u);
}

TEST(SweepTest, MoreSamplesAndMoreAxesChangeNoneThatWereThere) {
  const std::string text = "method = 'random'\nfriction = {from = 0.1, to = 1, log = true}\n";
  const std::vector<double> few = NumbersOf(PointsIn(text + "samples = 3\n"), "friction");
  const std::vector<double> more = NumbersOf(
      PointsIn(text + "samples = 5\nset.b = {from = 1, to = 6, whole = true}\n"), "friction");
  EXPECT_TRUE(std::equal(few.begin(), few.end(), more.begin()));
  EXPECT_NE(few, NumbersOf(PointsIn(text + "samples = 3\nsample_seed = 2\n"), "friction"));
}

TEST(SweepTest, WholeNumbersAreDrawnFromEndToEnd) {
  std::set<double> drawn;
  for (const double number : NumbersOf(
           PointsIn("method = 'random'\nsamples = 200\nset.b = {from = 1, to = 6, whole = true}\n"),
           "b")) {
    drawn.insert(number);
  }
  EXPECT_EQ(drawn, (std::set<double>{1, 2, 3, 4, 5, 6}));
}

TEST(SweepTest, ARunSaysItselfWhatTheOthersGoThrough) {
  const auto points =
      PointsIn("seeds = [1, 2]\n[[run]]\nfriction = 0.1\n[[run]]\nseed = 7\nset = {a = 3}\n");
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(NumbersOf(points, "seed"), (std::vector<double>{1, 2, 7}));
  EXPECT_EQ(points[1]["friction"], 0.1);
  EXPECT_FALSE(points[2].contains("friction"));
  EXPECT_EQ(OptionsOf(points[2], "folder").set, std::vector<std::string>{"a=3"});
}

TEST(SweepTest, SettingsThatAreCalledLikeAnInputAreNotTaken) {
  const auto points = PointsIn("seed = 5\n[set]\nseed = 3\nMTRAN.active_block.mass = [0.1, 0.2]\n");
  ASSERT_EQ(points.size(), 2u);
  const RunOptions options = OptionsOf(points[1], "folder");
  EXPECT_EQ(options.seed, 5u);
  EXPECT_EQ(options.set, (std::vector<std::string>{"seed=3", "MTRAN.active_block.mass=0.2"}));
  EXPECT_EQ(options.model_file, "folder/m");
}

TEST(SweepTest, WordsOfTheCommandLineTakeThePlaceOfTheFile) {
  const auto points = PointsIn("friction = [0.4, 0.8]\n[set]\na = 1\n",
                               {"friction=0.5", "a=10..20:5", "seeds=1,2"});
  EXPECT_EQ(points.size(), 6u);
  EXPECT_EQ(NumbersOf(points, "a"), (std::vector<double>{10, 10, 15, 15, 20, 20}));
}

TEST(SweepTest, TheyReplaceWhatARunSaysAndWhatStandsInTables) {
  const auto points = PointsIn(
      "[set.MTRAN.active_block]\nmass = 0.2\n[[run]]\nfriction = 0.1\nset = {a = 3}\n"
      "[[run]]\nset.MTRAN.active_block.mass = 0.3\n",
      {"friction=0.7", "a=5", "MTRAN.active_block.mass=0.4"});
  ASSERT_EQ(points.size(), 2u);
  for (const RunPoint& point : points) {
    EXPECT_EQ(point["friction"], 0.7);
    EXPECT_EQ(point["a"], 5);
    EXPECT_EQ(point["MTRAN.active_block.mass"], 0.4);
  }
}

TEST(SweepTest, NumbersThatAreWrittenWholeStayWhole) {
  // An int of a program takes 3, and not 3.0.
  const auto set_of = [](const std::string& values) {
    std::vector<std::string> settings;
    for (const RunPoint& point : PointsIn("[set]\nn = " + values + "\n"))
      settings.push_back(OptionsOf(point, "folder").set.front());
    return settings;
  };
  EXPECT_EQ(set_of("{from = 1, to = 9, step = 4}"),
            (std::vector<std::string>{"n=1", "n=5", "n=9"}));
  EXPECT_EQ(set_of("{from = 1, to = 2, step = 0.5}"),
            (std::vector<std::string>{"n=1.0", "n=1.5", "n=2.0"}));
  EXPECT_EQ(set_of("{from = 1.0, to = 2, count = 2}"),
            (std::vector<std::string>{"n=1.0", "n=2.0"}));
}

TEST(SweepTest, SettingsThatAreCalledLikeAFigureStandBehindSet) {
  const auto points = PointsIn("[set]\nwalk = 1\nhash = 2\nvariant = 3\nstride = 4\n");
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0], (Json{{"model", "m"},
                             {"program", "p"},
                             {"seconds", 1.0},
                             {"set.walk", 1},
                             {"set.hash", 2},
                             {"set.variant", 3},
                             {"stride", 4}}));
  EXPECT_EQ(OptionsOf(points[0], "folder").set,
            (std::vector<std::string>{"walk=1", "hash=2", "variant=3", "stride=4"}));
}

TEST(SweepTest, ACommandIsQuotedForAShell) {
  const RunPoint point = {{"model", "it's.m3l"}, {"program", "p.dyn"}, {"seconds", 1.5},
                          {"still", true},       {"world", ""},        {"a", "x y"}};
  EXPECT_EQ(
      RunCommand(point, ""),
      "morphbus run 'it'\\''s.m3l' p.dyn --seconds 1.5 --still --set 'a=x y' --inproc --no-log");
}

/// The value of an expression, where x is 2, text "a b", none unknown and truth true.
Json ValueOf(const std::string& text) {
  ExpressionError error;
  const auto expression = FigureExpression::Read(text, &error);
  if (!expression) return "error: " + error.message;
  const auto lookup = [](const std::string& name) -> std::optional<Json> {
    const Json figures = {
        {"x", 2.0}, {"walk.x", 3.0}, {"text", "a b"}, {"none", nullptr}, {"truth", true}};
    return figures.contains(name) ? std::optional(figures[name]) : std::nullopt;
  };
  const Json value = expression->Evaluate(lookup, &error);
  return error.message.empty() ? value : Json("error: " + error.message);
}

TEST(FigureExpressionTest, OperatorsBindAsUsual) {
  EXPECT_EQ(ValueOf("1 + 2 * 3 - 4 / 2"), 5.0);
  EXPECT_EQ(ValueOf("(1 + 2) * -x"), -6.0);
  EXPECT_EQ(ValueOf("10 - 3 - 2"), 5.0);
  EXPECT_EQ(ValueOf("not x > 3 and truth or false"), true);
  EXPECT_EQ(ValueOf("walk.x == 3 and text == 'a b'"), true);
  EXPECT_EQ(ValueOf("hypot(3, 4) + max(1, x) + min(5, 4) + abs(-1) + sqrt(4)"), 14.0);
}

TEST(FigureExpressionTest, NumbersHaveUnits) {
  EXPECT_EQ(ValueOf("70 mm"), 70 * 1e-3);
  EXPECT_EQ(ValueOf("20% + 1min"), 20 * 1e-2 + 60);
  EXPECT_EQ(ValueOf("x >= 1 and x < 2000 mm"), false);
  EXPECT_EQ(ValueOf("3 furlongs"),
            "error: there is no unit 'furlongs'; there are mm, cm, m, km, ms, s, min, deg, rad, %");
}

/// What is wrong with the units of an expression, of which x is in metres, t in seconds, n a plain
/// number, and all else of no known unit; and where.
std::string MixedUnitsIn(const std::string& text) {
  ExpressionError error;
  const auto unit_of = [](const std::string& name) -> std::string_view {
    return name == "x" ? "m" : name == "t" ? "s" : name == "n" ? "1" : "";
  };
  const auto mixed = FigureExpression::Read(text, &error)->FindMixedUnits(unit_of);
  return mixed ? std::to_string(mixed->offset) + ": " + mixed->message : "";
}

TEST(FigureExpressionTest, UnitsAreNotMixed) {
  for (const char* good :
       {"x > 1", "x + 0.5 > 1 km", "x / t > 3 mm", "2 * x > 1 deg", "sqrt(x) == 1 s", "n >= 20%",
        "y > 1 deg and y > 1 m", "abs(x - 1 mm) < hypot(x, 1) or -t < 1 min", "'x' == y"}) {
    EXPECT_EQ(MixedUnitsIn(good), "");
  }
  const std::string rest = " cannot be compared or added; expected the same unit";
  EXPECT_EQ(MixedUnitsIn("x > 1 deg"), "2: values in m and in rad" + rest);
  EXPECT_EQ(MixedUnitsIn("x > 1 and not 3 ms == -x"), "19: values in s and in m" + rest);
  EXPECT_EQ(MixedUnitsIn("x + 0 - abs(t) > 1"), "6: values in m and in s" + rest);
  EXPECT_EQ(MixedUnitsIn("1 < max(1, x, t)"), "4: values in m and in s" + rest);
  EXPECT_EQ(MixedUnitsIn("2 * (x + 20%) > y"), "7: values in m and without a unit" + rest);
  EXPECT_EQ(MixedUnitsIn("n > 3 s"), "2: values without a unit and in s" + rest);
}

TEST(FigureExpressionTest, WhatIsUnknownStaysSo) {
  EXPECT_TRUE(ValueOf("none + 1 > 0").is_null());
  EXPECT_TRUE(ValueOf("none and true").is_null());
  EXPECT_EQ(ValueOf("none > 1 and false"), false);
  EXPECT_EQ(ValueOf("none > 1 or true"), true);
  EXPECT_TRUE(ValueOf("1 / 0").is_null());
}

TEST(FigureExpressionTest, WhatMakesNoSenseIsSaid) {
  EXPECT_EQ(ValueOf("x >="), "error: a value is missing");
  EXPECT_EQ(ValueOf("x = 2"), "error: there is something behind the expression");
  EXPECT_EQ(ValueOf("(x"), "error: expected )");
  EXPECT_EQ(ValueOf("y > 1"), "error: there is no figure 'y'");
  EXPECT_EQ(ValueOf("text + 1"), "error: only numbers can be computed with");
  EXPECT_EQ(ValueOf("text > 1"), "error: values of unlike kinds cannot be compared");
  EXPECT_EQ(ValueOf("sin(1)"),
            "error: there is no function 'sin'; there are abs, sqrt, hypot, min, max");
  EXPECT_EQ(ValueOf(std::string(1000, '(')), "error: the expression has too many brackets");
  EXPECT_EQ(ValueOf(std::string(1000, '-') + "1"), "error: the expression has too many signs");
}

}  // namespace
}  // namespace morphbus::tools
