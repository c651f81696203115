#pragma once
// The rows of a sweep before they run: each a run's description, and the key that its inputs have.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/sweep/sweep_file.h"

namespace morphbus::tools {

/// What a run's inputs are, as bytes that any machine can run: parts that many rows share (model,
/// program, world), by their hashes, and what is the row's own. The serialized description is the
/// bytes of all parts and then those of `own`, one behind the other.
struct RowInputs {
  std::vector<std::string> parts;
  std::string own;
};

/// One row.
struct PlannedRow {
  RunPoint point;
  /// Hash of all that decides how the run goes, 32 hexadecimal digits: equal for runs of equal
  /// inputs, whatever their files are called, when they began, and where they stand in a plan.
  std::string key;
  RowInputs inputs;
};

/// All rows in their order, and the parts that they share.
struct SweepPlan {
  std::vector<PlannedRow> rows;
  std::map<std::string, std::string> parts;
};

/// Plans one row after the other. Models and programs are compiled once, for all rows.
class SweepPlanner {
 public:
  explicit SweepPlanner(const SweepFile& sweep);
  ~SweepPlanner();
  SweepPlanner(const SweepPlanner&) = delete;
  SweepPlanner& operator=(const SweepPlanner&) = delete;

  /// Adds a row to the plan. False after printing why it cannot run.
  bool Add(const RunPoint& point);
  /// What was planned since it was taken last; parts may come again.
  SweepPlan Take();

 private:
  class Compiled;
  std::unique_ptr<Compiled> compiled_;
};

/// Compiles models and programs, each once, and plans all rows. What is wrong is printed, with the
/// row whose run it is; the result is then empty.
std::optional<SweepPlan> PlanSweep(const SweepFile& sweep);

}  // namespace morphbus::tools
