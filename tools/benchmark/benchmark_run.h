#pragma once
// One robot at one task, from its files to its figures.

#include <optional>
#include <string>

#include "tools/base/json.h"
#include "tools/benchmark/benchmark_file.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// How a robot did at a task.
struct BenchmarkOutcome {
  std::string error;  ///< Why the run failed; empty if it ended well.
  bool met = false;
  Json figures = Json::object();  ///< By name; null for what the run does not have.
  std::string hash;               ///< Of the run.
};

/// The run of a robot at a task. Nothing, after printing why, if it cannot be.
std::optional<RunPlan> PlanBenchmark(const BenchmarkTask& task, const BenchmarkRobot& robot);

/// Runs it in this process, without a log. The same plan gives the same outcome, to the last digit.
BenchmarkOutcome RunBenchmark(const BenchmarkTask& task, RunPlan plan);

}  // namespace morphbus::tools
