#include "tools/sweep/sweep_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "tools/sweep/row_run.h"

namespace morphbus::tools {

Result<SweepEstimate> EstimateOf(const SweepPlan& plan) {
  SweepEstimate estimate;
  // How much simulated time there is, each run once.
  std::set<std::string> keys;
  double sim_seconds = 0;
  proto::RunDescription own;
  for (const PlannedRow& row : plan.rows) {
    if (!keys.insert(row.key).second || !own.ParseFromString(row.inputs.own)) continue;
    sim_seconds += own.seconds();
    estimate.bytes += static_cast<int64_t>(row.inputs.own.size() + JsonText(row.point).size());
  }
  for (const auto& [hash, bytes] : plan.parts) estimate.bytes += static_cast<int64_t>(bytes.size());
  estimate.runs = static_cast<int64_t>(keys.size());
  // Of how much wall time a simulated second is, and a run by itself.
  constexpr double kProbe = 1.0;
  double wall = 0, simulated = 0;
  size_t figures = 0;
  const std::set<size_t> probes = {0, plan.rows.size() / 2, plan.rows.size() - 1};
  for (const size_t probe : probes) {
    const RowInputs& inputs = plan.rows[probe].inputs;
    std::string description;
    for (const std::string& hash : inputs.parts) description += plan.parts.at(hash);
    own.ParseFromString(inputs.own);
    own.set_seconds(std::min(own.seconds(), kProbe));
    const RowResult result = RunForRow(description + own.SerializeAsString(), "");
    if (result.status != RowResult::Status::kRan) {
      return Fail(fmt::format("row {} failed: {}", probe + 1, result.error));
    }
    wall += result.seconds;
    simulated += own.seconds();
    figures = std::max(figures, result.figures.size());
  }
  estimate.run_seconds = sim_seconds * wall / simulated;
  // Keys, hashes and SQLite's own.
  constexpr size_t kOverhead = 400;
  estimate.bytes += estimate.runs * static_cast<int64_t>(figures + kOverhead);
  return estimate;
}

std::string DurationText(double seconds) {
  if (seconds < 10) return fmt::format("{:.1f} s", seconds);
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  return seconds < 7200 ? fmt::format("{:.0f} min", seconds / 60)
                        : fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace morphbus::tools
