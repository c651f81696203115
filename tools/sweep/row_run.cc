#include "tools/sweep/row_run.h"

#include <unistd.h>

#include <algorithm>
#include <array>

#include "compiler/base/version.h"
#include "tools/launch/inproc_run.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/run_registry.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {
namespace {

constexpr std::array<const char*, 4> kStatus = {"done", "failed", "crashed", "timeout"};

/// Keys of SummaryJson that are the same whenever the same inputs run, beside those of figures.
constexpr std::array<const char*, 11> kOfRun = {
    "ticks",      "messages",   "lost",  "resent",           "refused", "num_faults",
    "num_prints", "world_hash", "roles", "missed_deadlines", "ended"};

/// Adds the values in `json` under names that begin with `name`.
void Flatten(const std::string& name, const Json& json, Json* flat) {
  static constexpr std::array<const char*, 3> kDirections = {"north", "up", "east"};
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) Flatten(name + "." + key, value, flat);
  } else if (!json.is_array()) {
    (*flat)[name] = json;
  } else if (name.ends_with("displacement") || name.ends_with("mean_n")) {
    for (size_t i = 0; i < kDirections.size(); ++i) (*flat)[name + "." + kDirections[i]] = json[i];
  }
}

}  // namespace

RowResult NewResult() {
  RowResult result;
  result.version = Version();
  std::array<char, 256> host = {};
  if (gethostname(host.data(), host.size() - 1) == 0) result.host = host.data();
  return result;
}

const char* StatusText(RowResult::Status status) { return kStatus[static_cast<size_t>(status)]; }

RowResult::Status StatusOfText(const std::string& text) {
  for (size_t i = 0; i < kStatus.size(); ++i) {
    if (text == kStatus[i]) return static_cast<RowResult::Status>(i);
  }
  return RowResult::Status::kErred;
}

Json FlatFigures(const RunSummary& summary) {
  Json flat = Json::object();
  const Json run = SummaryJson(summary);
  for (const char* key : kOfRun) Flatten(key, run[key], &flat);
  // The object of figures has its keys in another order than run --json, which is all the same
  // here.
  const nlohmann::json figures = logger::FiguresJson(summary.figures);
  for (const auto& [key, value] : figures.items()) {
    Flatten(key, Json(value), &flat);
  }
  return flat;
}

std::optional<Json> FigureOf(const Json& figures, const std::string& name) {
  const auto found = figures.find(name);
  if (found != figures.end()) return *found;
  // What belongs to something unknown is unknown.
  for (size_t point = name.rfind('.'); point != std::string::npos && point > 0;
       point = name.rfind('.', point - 1)) {
    const auto whole = figures.find(name.substr(0, point));
    if (whole != figures.end() && whole->is_null()) return Json(nullptr);
  }
  return std::nullopt;
}

std::vector<std::string> FigureGroups() {
  std::vector<std::string> names(kOfRun.begin(), kOfRun.end());
  const nlohmann::json figures = logger::FiguresJson({});
  for (const auto& [key, value] : figures.items()) names.push_back(key);
  return names;
}

RowResult RunForRow(const std::string& description, const std::string& log) {
  const Result<RunRecord> record =
      log.empty() ? RunRecord::InMemory() : Result<RunRecord>(RunRecord(log));
  if (record) return RunForRow(description, *record);
  RowResult result = NewResult();
  result.error = record.error().message;
  return result;
}

RowResult RunForRow(const std::string& description, const RunRecord& record) {
  RowResult result = NewResult();
  const WallTimer timer;
  Result<RunPlan> plan = PlanFromDescription(description);
  const Result<bridge::RunKey> key = plan && plan->description.open()
                                         ? Result<bridge::RunKey>(bridge::RunKey())
                                         : bridge::RunKey::Random();
  if (!plan || !key) {
    result.error = (plan ? key.error() : plan.error()).message;
    return result;
  }
  // The name has no part in what happens.
  plan->description.set_run("sweep");
  plan->description.set_started(WallTime());
  const RunSummary summary = Summarize(*plan, RunInProcess(*plan, record, *key));
  result.seconds = timer.seconds();
  result.error = summary.outcome.error;
  // A run that a signal has cut short is not the row's.
  if (result.error.empty() && CaughtSignal() != 0) result.error = "it was interrupted";
  if (!result.error.empty()) return result;
  result.status = RowResult::Status::kRan;
  result.hash = summary.hash;
  result.figures = JsonText(FlatFigures(summary));
  return result;
}

}  // namespace morphbus::tools
