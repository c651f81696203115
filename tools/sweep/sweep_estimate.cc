#include "tools/sweep/sweep_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "tools/sweep/local_engine.h"
#include "tools/sweep/row_run.h"

namespace morphbus::tools {
namespace {

/// How much of a row is run for an estimate, simulated time (s).
constexpr double kProbeSeconds = 1.0;

/// The beginning of one row.
class ProbeRow : public RowSource {
 public:
  ProbeRow(RowSource* source, RowTask task) : source_(*source), task_(std::move(task)) {}
  Result<std::optional<RowTask>> Next() override {
    return std::exchange(given_, true) ? std::optional<RowTask>() : std::optional(task_);
  }
  Result<RowInputs> Inputs(const std::string& key) override { return source_.Inputs(key); }
  Result<std::string> Part(const std::string& hash) override { return source_.Part(hash); }
  Result<void> Take(const RowTask& /*task*/, const RowResult& result) override {
    result_ = result;
    return {};
  }
  bool GoOn() override { return source_.GoOn(); }
  [[nodiscard]] const std::optional<RowResult>& result() const { return result_; }

 private:
  RowSource& source_;
  RowTask task_;
  bool given_ = false;
  std::optional<RowResult> result_;
};

}  // namespace

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
  double wall = 0, simulated = 0;
  size_t figures = 0;
  const std::set<size_t> probes = {0, plan.rows.size() / 2, plan.rows.size() - 1};
  for (const size_t probe : probes) {
    const RowInputs& inputs = plan.rows[probe].inputs;
    std::string description;
    for (const std::string& hash : inputs.parts) description += plan.parts.at(hash);
    own.ParseFromString(inputs.own);
    own.set_seconds(std::min(own.seconds(), kProbeSeconds));
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

double WallTimeOfSecond(RowSource* source, const RowTask& task) {
  RowTask probe = task;
  probe.log.clear();
  proto::RunDescription own;
  if (!own.ParseFromString(probe.inputs.own)) return 1;
  own.set_seconds(std::min(own.seconds(), kProbeSeconds));
  probe.inputs.own = own.SerializeAsString();
  ProbeRow row(source, std::move(probe));
  const Result<void> run = RunLocally({1, 0}, &row);
  const std::optional<RowResult>& result = row.result();
  if (!run || !result || result->status != RowResult::Status::kRan || !(own.seconds() > 0)) {
    return 1;
  }
  return result->seconds / own.seconds();
}

std::string DurationText(double seconds) {
  if (seconds < 10) return fmt::format("{:.1f} s", seconds);
  if (seconds < 120) return fmt::format("{:.0f} s", seconds);
  return seconds < 7200 ? fmt::format("{:.0f} min", seconds / 60)
                        : fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace morphbus::tools
