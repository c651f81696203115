#pragma once
// Tasks for robots and the robots that ship for them, as people write them in TOML
// (docs/benchmark.md).

#include <optional>
#include <string>
#include <vector>

#include "tools/sweep/figure_expression.h"

namespace morphbus::tools {

/// A push at the robot's trunk.
struct BenchmarkPush {
  double after_s = 0;     ///< When it begins (sim time).
  double seconds = 0;     ///< How long it lasts.
  std::string direction;  ///< As `control push` takes it: "EAST", "1,0,1".
  double weights = 0;     ///< The force, by how many times the robot's weight.
  double settle_s = 0;    ///< So long after it the robot may take to find its feet.
};

/// What a robot is to do. Its figures are those of docs/benchmark.md.
struct BenchmarkTask {
  std::string name;       ///< That of its file, without ".toml".
  std::string title;      ///< For people: "10 m straight".
  double seconds = 0;     ///< The most that it may take (sim time).
  std::string world;      ///< Path of an SDFormat file; empty: level ground alone.
  double friction = 0.8;  ///< As `run --friction`.
  std::optional<BenchmarkPush> push;
  /// Ends the run as soon as it holds at a whole second; without one it lasts for `seconds`.
  std::optional<FigureExpression> until;
  /// Whether the task is met, when the run is over.
  std::optional<FigureExpression> met;
};

/// A robot with its program.
struct BenchmarkRobot {
  std::string model, robot, program;  ///< Paths, and the robot's name.
  std::string compiled_for;           ///< Path of the model that has all words of the program;
                                      ///< empty: its own.
  std::string params;                 ///< Path of settings (`run --params`); empty: none.
  std::vector<std::string> set;       ///< Settings (`run --set`).
  std::string settings_from = "--";   ///< RunOptions::settings_from.
  std::vector<std::string> tasks;     ///< By name, those at which it is looked at; empty: all.
  std::vector<std::string> meets;     ///< Those of them that it is meant to meet.
};

/// All that is in a folder.
struct Benchmark {
  std::string folder;
  std::vector<BenchmarkTask> tasks;    ///< In order of name.
  std::vector<BenchmarkRobot> robots;  ///< In the order of robots.toml.
};

/// Reads robots.toml of a folder, and a task from each other *.toml. Nothing, after printing what
/// is wrong and where.
std::optional<Benchmark> ReadBenchmark(const std::string& folder);

}  // namespace morphbus::tools
