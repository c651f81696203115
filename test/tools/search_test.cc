// What a search tries next, and which of what it tried is best.

#include <gtest/gtest.h>

#include <algorithm>

#include "tools/sweep/search.h"

namespace morphbus::tools {
namespace {

using Vectors = std::vector<std::vector<double>>;

/// A first generation of `count` vectors with three coordinates.
Vectors Spread(int count) {
  Vectors first;
  for (int i = 0; i < count; ++i) {
    const double at = (i + 0.5) / count;
    first.push_back({at, 1 - at, at * at});
  }
  return first;
}

/// The square of the distance from (0.3, 0.6, 0.8).
double Bowl(const std::vector<double>& x) {
  const double a = x[0] - 0.3, b = x[1] - 0.6, c = x[2] - 0.8;
  return a * a + b * b + c * c;
}

/// What is asked for in a number of generations, where the goal is Bowl.
Vectors Asked(uint64_t seed, int generations) {
  SearchMethod method(SearchAlgorithm::kCmaEs, 1, seed, Spread(8));
  Vectors all;
  for (int i = 0; i < generations; ++i) {
    Vectors values;
    for (const std::vector<double>& x : method.Ask()) {
      all.push_back(x);
      values.push_back({Bowl(x)});
    }
    method.Tell(values);
  }
  return all;
}

TEST(SearchMethodTest, CmaEsComesToTheLeastValueInsideTheCube) {
  const Vectors asked = Asked(1, 60);
  ASSERT_EQ(asked.size(), 480u);
  EXPECT_LT(Bowl(asked.back()), 1e-6);
  for (const std::vector<double>& x : asked) {
    for (const double one : x) EXPECT_TRUE(one >= 0 && one <= 1) << one;
  }
}

TEST(SearchMethodTest, ASeedDecidesAll) {
  EXPECT_EQ(Asked(1, 6), Asked(1, 6));
  EXPECT_NE(Asked(1, 6), Asked(2, 6));
}

TEST(SearchMethodTest, AskingTwiceIsAskingOnce) {
  SearchMethod method(SearchAlgorithm::kCmaEs, 1, 1, Spread(8));
  Vectors values(8, {1.0});
  values[3] = {0.0};
  method.Ask();
  method.Tell(values);
  const Vectors once = method.Ask();
  EXPECT_EQ(once.size(), 8u);
  EXPECT_EQ(method.Ask(), once);
}

TEST(SearchMethodTest, NsgaFindsWhatLiesBetweenTwoGoals) {
  SearchMethod method(SearchAlgorithm::kNsga2, 2, 1, Spread(20));
  Vectors tried, costs;
  for (int i = 0; i < 40; ++i) {
    Vectors values;
    for (const std::vector<double>& x : method.Ask()) {
      tried.push_back(x);
      // Nearer to 0 and nearer to 1 in the first coordinate; the others are to be 0.
      const double rest = x[1] + x[2];
      values.push_back({x[0] + rest, 1 - x[0] + rest});
      costs.push_back(values.back());
    }
    method.Tell(values);
  }
  const std::vector<size_t> front = ParetoFront(costs);
  EXPECT_GT(front.size(), 10u);
  const auto place = [&](size_t i) { return tried[i][0]; };
  double low = 1, high = 0;
  for (const size_t i : front) {
    low = std::min(low, place(i));
    high = std::max(high, place(i));
  }
  EXPECT_LT(low, 0.1);
  EXPECT_GT(high, 0.9);
}

TEST(ParetoFrontTest, NobodyInItIsBeaten) {
  EXPECT_EQ(ParetoFront({{1, 5}, {2, 4}, {3, 4}, {2, 4}, {0, 6}, {5, 1}}),
            (std::vector<size_t>{0, 1, 4, 5}));
  EXPECT_EQ(ParetoFront({{2}, {1}, {1}}), std::vector<size_t>{1});
  EXPECT_TRUE(ParetoFront({}).empty());
}

TEST(CostsTest, WhatMustNotBeChosenIsWorseThanAllElse) {
  SearchFile search;
  ExpressionError none;
  search.goals.push_back({*FigureExpression::Read("path_length", &none), false});
  search.goals.push_back({*FigureExpression::Read("energy", &none), true});
  const SearchCandidate far = {{}, {9.0, 5.0}, 0, 1}, near = {{}, {2.0, 1.0}, 0, 2};
  const SearchCandidate broken = {{}, {99.0, 0.0}, 1, 3}, more = {{}, {99.0, std::nullopt}, 2, 4};
  EXPECT_EQ(CostsOf(search, far), (std::vector<double>{-9, 5}));
  for (size_t goal = 0; goal < 2; ++goal) {
    EXPECT_GT(CostsOf(search, broken)[goal], CostsOf(search, near)[goal]);
    EXPECT_GT(CostsOf(search, more)[goal], CostsOf(search, broken)[goal]);
  }
  SearchOutcome outcome;
  outcome.candidates = {broken, far, near, more, far};
  EXPECT_EQ(outcome.Best(search), (std::vector<size_t>{1, 2}));
  search.goals.pop_back();
  EXPECT_EQ(outcome.Best(search), std::vector<size_t>{1});
}

/// The errors of a file with these lines behind those that every search has.
std::string ErrorsOf(const std::string& text, const std::vector<std::string>& words = {}) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText("s.toml", "model = 'm'\nprogram = 'p'\nseconds = 1\n" + text);
  const auto search = ReadSearchFile(&sources, file, "folder/s.toml", words, &diagnostics);
  return search ? "" : source::Render(diagnostics, sources, false);
}

TEST(SearchFileTest, WhatIsWrongHasItsPlace) {
  const std::string good = "maximise = 'path_length'\n";
  const std::string sought = "[search]\na = {from = 1, to = 6}\n";
  EXPECT_EQ(ErrorsOf(good + sought), "");
  EXPECT_NE(ErrorsOf(sought).find("does not say what for"), std::string::npos);
  EXPECT_NE(ErrorsOf(good).find("nothing to be sought"), std::string::npos);
  EXPECT_NE(ErrorsOf(good + "[search]\na = 3\n").find("s.toml:6:5: error: expected a range"),
            std::string::npos);
  EXPECT_NE(ErrorsOf("minimise = ['a', 'b +']\n" + sought).find("s.toml:4:22: error: a value"),
            std::string::npos);
  EXPECT_NE(
      ErrorsOf(good + "algorithm = 'nsga-2'\npopulation = 10\n" + sought).find("a multiple of 4"),
      std::string::npos);
  EXPECT_NE(ErrorsOf(good + "minimise = 'energy'\nalgorithm = 'cma-es'\n" + sought)
                .find("CMA-ES has one goal"),
            std::string::npos);
  EXPECT_NE(ErrorsOf(good + "set.a = 4\n" + sought).find("'a' is set, and sought"),
            std::string::npos);
  EXPECT_NE(ErrorsOf("maximise = 'a * path_lenth'\n" + sought)
                .find("s.toml:4:17: error: there is no figure 'path_lenth'"),
            std::string::npos);
  EXPECT_NE(ErrorsOf(good + sought, {"population=3"}).find("expected a whole number, 5 to"),
            std::string::npos);
}

TEST(SearchFileTest, KeysOfTheSearchAreItsOwnAndOthersTheSweeps) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText(
      "s.toml",
      "model = 'm'\nprogram = 'p'\nseconds = 1\nseeds = [1, 2]\nmaximise = 'path_length'\n"
      "minimise = 'energy'\nof_runs = 'worst'\nsubject_to = 'num_faults < "
      "seed'\n[search.MTRAN.joint_1]\ntorque = {from = 1, to "
      "= 2, log = true}\n");
  const auto search =
      ReadSearchFile(&sources, file, "folder/s.toml", {"generations=7", "seed=3"}, &diagnostics);
  ASSERT_TRUE(search) << source::Render(diagnostics, sources, false);
  EXPECT_EQ(search->goals.size(), 2u);
  EXPECT_FALSE(search->goals[0].smallest);
  EXPECT_TRUE(search->goals[1].smallest);
  EXPECT_EQ(search->algorithm, SearchAlgorithm::kNsga2);
  EXPECT_TRUE(search->worst);
  EXPECT_EQ(search->conditions.size(), 1u);
  EXPECT_EQ(search->generations, 7);
  EXPECT_EQ(search->sought.front().name, "MTRAN.joint_1.torque");
  EXPECT_EQ(search->sweep.axes.back().values, std::vector<Json>{3});
}

}  // namespace
}  // namespace morphbus::tools
