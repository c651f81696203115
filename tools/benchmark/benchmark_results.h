#pragma once
// What came of tasks: rows of a table, and those that a folder says its robots get on every
// machine.

#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "tools/base/json.h"
#include "tools/benchmark/benchmark_file.h"
#include "tools/benchmark/benchmark_run.h"

namespace morphbus::tools {

/// A robot at a task. Names are without folders and endings, as results.json and the table have
/// them.
struct BenchmarkRow {
  const BenchmarkTask* task = nullptr;
  std::string model, robot, program, settings;
  bool meant = false;  ///< Whether the robot is meant to meet the task; else it is looked at only.
  /// Of what the run is made of, as the run's description has them (16 hex digits). All messages of
  /// a run name its model and its program, so that with others the run has another hash, too.
  std::string model_hash, program_hash, world_hash;
  BenchmarkOutcome outcome;
};

/// A row of a robot whose outcome is still to come.
BenchmarkRow RowOf(const BenchmarkTask& task, const BenchmarkRobot& robot);

/// `{"task":…,"model":…,"robot":…,"program":…,"settings":…,"meant":…,"model_hash":…,
/// "program_hash":…,"world_hash":…,"met":…,"hash":…,"figures":{…},"error":…}`; `settings` is null
/// without any, `error` of a run that went well.
Json RowJson(const BenchmarkRow& row);

/// The rows that FOLDER/results.json has, as RowJson makes them; none without the file. Fails for
/// one that is no such list.
Result<std::vector<Json>> ReadResults(const std::string& folder);
/// Writes the rows there, by task and robot in the order of `benchmark`: those of the file that are
/// of other robots or tasks stay.
Result<void> WriteResults(const Benchmark& benchmark, const std::vector<BenchmarkRow>& rows);
/// The row of `results` with the same task, model, robot, program and settings; null if there is
/// none.
const Json* FindResult(const std::vector<Json>& results, const BenchmarkRow& row);
/// Of "model", "program" and "world" those that are others now than when `known` was written, a row
/// of results.json.
std::vector<std::string> OtherInputs(const BenchmarkRow& row, const Json& known);

/// The title of a task with the heads of the columns, and a row of it (RowJson), for people.
std::string TaskHeading(const BenchmarkTask& task);
std::string RowText(const Json& row);

}  // namespace morphbus::tools
