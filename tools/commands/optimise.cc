// morphbus optimise: searches for settings with which a robot does something best.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "compiler/base/text.h"
#include "tools/base/json.h"
#include "tools/commands/commands.h"
#include "tools/commands/sweep.h"
#include "tools/launch/launcher_link.h"
#include "tools/sweep/sampling.h"
#include "tools/sweep/search.h"
#include "tools/sweep/sweep_estimate.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus optimise`.
struct OptimiseOptions : SweepOptions {
  /// Path of the file of settings; empty: FILE.best.toml.
  std::string settings;
  /// Which of several best candidates, from 1; 0: the one that the command chooses.
  int pick = 0;
};

/// A search, read, and what it was read from.
struct ReadySearch {
  SearchFile search;
  SweepOrigin origin;
};

/// Reads the file; nothing after saying what is wrong.
std::optional<ReadySearch> Prepare(OptimiseOptions* options) {
  std::optional<SweepOrigin> origin = OriginOf(*options);
  if (!origin) return std::nullopt;
  std::optional<SearchFile> search = ReadOrigin(*options, *origin, ReadSearchFile);
  if (!search || !CheckRanges(*search)) return std::nullopt;
  if (!ChooseEngine(search->sweep.engine, origin->folder, options)) return std::nullopt;
  return ReadySearch{std::move(*search), std::move(*origin)};
}

/// --dry-run: how many runs it would be, at most, and about how long.
int Estimate(const ReadySearch& ready, const OptimiseOptions& options) {
  const SearchFile& search = ready.search;
  // What one candidate runs, which every other one does as well.
  const std::optional<SweepPlan> one = PlanSweep(search.sweep);
  if (!one) return kUnusable;
  const Result<SweepEstimate> estimate = EstimateOf(*one);
  if (!estimate) return Failed(estimate.error().message);
  const int64_t candidates =
      int64_t{search.population} * search.generations * (search.restarts + 1);
  const auto runs = static_cast<int64_t>(one->rows.size()) * (candidates + 1);
  const double seconds = estimate->run_seconds * static_cast<double>(candidates + 1);
  const int jobs = options.engines.kind == EngineKind::kLocal ? JobsOf(options) : 1;
  if (options.json) {
    PrintJson({{"candidates", candidates},
               {"rows", runs},
               {"jobs", jobs},
               {"wall_seconds", seconds / jobs}});
    return kDone;
  }
  Print("{}, {} in all\nabout {}\n", Counted(candidates, "candidate"), Counted(runs, "run"),
        EstimateText(seconds, options));
  return kDone;
}

/// Of several candidates of which none is better than another the one that is nearest to the best
/// of all goals at once, each in parts of what lies between the best and the worst of them.
size_t Knee(const SearchFile& search, const SearchOutcome& outcome,
            const std::vector<size_t>& best) {
  std::vector<double> distance(best.size(), 0.0);
  for (size_t goal = 0; goal < search.goals.size(); ++goal) {
    // All that may be chosen have a value for every goal.
    std::vector<double> values;
    for (const size_t index : best) values.push_back(*outcome.candidates[index].goals[goal]);
    const auto [low, high] = std::ranges::minmax(values);
    const double span = high > low ? high - low : 1.0;
    for (size_t i = 0; i < best.size(); ++i) {
      const double behind =
          (search.goals[goal].smallest ? values[i] - low : high - values[i]) / span;
      distance[i] += behind * behind;
    }
  }
  return static_cast<size_t>(std::ranges::min_element(distance) - distance.begin());
}

/// "gait.forward_m 0.0131 (+28 %)".
std::string GoalText(const SearchFile& search, const SearchCandidate& shipped,
                     const SearchCandidate& candidate) {
  std::vector<std::string> texts;
  for (size_t goal = 0; goal < search.goals.size(); ++goal) {
    const std::optional<double> value = candidate.goals[goal], before = shipped.goals[goal];
    std::string text = fmt::format("{} {}", search.goals[goal].expression.text(),
                                   value ? fmt::format("{:.6g}", *value) : "not known");
    if (value && before && *before != 0 && &candidate != &shipped) {
      text += fmt::format(" ({:+.1f} %)", (*value - *before) / std::abs(*before) * 100);
    }
    texts.push_back(std::move(text));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

Json CandidateJson(const SearchFile& search, const SearchCandidate& candidate) {
  Json goals = Json::array();
  for (const std::optional<double>& goal : candidate.goals)
    goals.push_back(goal ? Json(*goal) : Json());
  Json settings = Json::object();
  for (size_t i = 0; i < candidate.values.size(); ++i) {
    settings[SettingName(search.sought[i].name)] = candidate.values[i];
  }
  return {{"row", candidate.row},
          {"goals", goals},
          {"broken", candidate.broken},
          {"settings", settings}};
}

/// Says what was found.
void Tell(const ReadySearch& ready, const SearchOutcome& outcome, const std::vector<size_t>& best,
          size_t picked, const std::string& settings, const std::string& database, bool as_json) {
  const SearchFile& search = ready.search;
  if (as_json) {
    Json list = Json::array();
    for (const size_t index : best)
      list.push_back(CandidateJson(search, outcome.candidates[index]));
    PrintJson({{"database", database},
               {"candidates", outcome.candidates.size()},
               {"generations", outcome.generations},
               {"stopped", outcome.stopped},
               {"shipped", CandidateJson(search, outcome.shipped)},
               {"best", list},
               {"picked", best.empty() ? Json() : Json(outcome.candidates[best[picked]].row)},
               {"settings", settings.empty() ? Json() : Json(settings)}});
    return;
  }
  Print("{} in {}: {}\n", Counted(static_cast<int64_t>(outcome.candidates.size()), "candidate"),
        Counted(outcome.generations, "generation"), database);
  Print("  as it is: {}{}\n", GoalText(search, outcome.shipped, outcome.shipped),
        outcome.shipped.allowed() ? "" : " (a condition does not hold)");
  for (size_t i = 0; i < best.size(); ++i) {
    const SearchCandidate& one = outcome.candidates[best[i]];
    Print("  {}: {}, row {}\n",
          best.size() == 1 ? "best" : fmt::format("{}{}", i + 1, i == picked ? " (chosen)" : ""),
          GoalText(search, outcome.shipped, one), one.row);
  }
  if (!settings.empty()) Print("  morphbus run … --params {}\n", ShellWord(settings));
}

/// morphbus optimise FILE.
int Optimise(OptimiseOptions options) {
  const std::optional<ReadySearch> ready = Prepare(&options);
  if (!ready) return kUnusable;
  if (options.dry_run) return Estimate(*ready, options);
  const std::string settings =
      options.settings.empty()
          ? std::filesystem::path(options.file).replace_extension(".best.toml").string()
          : options.settings;
  if (!MayWrite(settings, outputs::kSettings, options.force, {options.file})) return kUnusable;
  // A search is long: a folder that is not there is told before it, and not after it.
  std::error_code unknown;
  const std::filesystem::path folder = std::filesystem::absolute(settings, unknown).parent_path();
  if (!std::filesystem::is_directory(folder, unknown)) {
    return Unusable(
        fmt::format("cannot write {}: there is no folder {}", settings, folder.string()));
  }
  Result<std::unique_ptr<SweepStore>> store =
      SweepStore::OpenToWrite(options.output.empty() ? DatabaseOf(options.file) : options.output);
  if (!store) return Unusable(store.error().message);
  CatchSignals();
  // Rows that failed are those of the plan before.
  Result<void> begun;
  if (options.retry) begun = (*store)->ForgetFailed();
  if (begun) begun = (*store)->SetPlan({}, ready->origin);
  if (!begun) return Failed(begun.error().message);
  // Where rows cannot be run, that has been said, and its status counts; all else that ends a
  // search early is up to the file.
  int status = kUnusable;
  const std::optional<SearchOutcome> outcome =
      RunSearch(ready->search, store->get(), [&](int64_t from, const std::string& label) {
        const int ran = RunMissing(store->get(), options, LastRows{from, label});
        if (ran != kDone) status = ran;
        return ran == kDone;
      });
  if (!outcome) return status;
  const std::vector<size_t> best = outcome->Best(ready->search);
  if (options.pick > static_cast<int>(best.size())) {
    return Unusable(fmt::format("--pick: there are {} best candidates", best.size()));
  }
  // A search that was stopped has a best candidate, too: the best one so far.
  size_t picked = 0;
  if (!best.empty()) {
    picked = options.pick > 0 ? static_cast<size_t>(options.pick - 1)
                              : Knee(ready->search, *outcome, best);
    const Result<void> written =
        WriteFile(settings, SettingsOf(ready->search, outcome->candidates[best[picked]]));
    if (!written) return Unusable(written.error().message);
  }
  Tell(*ready, *outcome, best, picked, best.empty() ? "" : settings, (*store)->path(),
       options.json);
  if (outcome->stopped) {
    Say("stopped; the same command goes on\n");
    return kNo;
  }
  // Jobs that an earlier call has left, and for which no generation has waited, are of no more use.
  if (options.engines.kind == EngineKind::kSlurm) {
    if (const int cleaned = RunMissing(store->get(), options); cleaned != kDone) return cleaned;
  }
  if (best.empty()) Say("no candidate fulfils all conditions (subject_to)\n");
  return best.empty() ? kNo : kDone;
}

}  // namespace

void AddOptimise(CommandLine* line) {
  Subcommand sub =
      line->Add("optimise", "Search for the settings with which a robot does something best");
  auto options = std::make_shared<OptimiseOptions>();
  sub.Add("FILE.toml", &options->file, "The search, in TOML (docs/optimise.md)").Required();
  sub.Add("VALUES", &options->overrides, "In the place of what the file says: generations=10");
  sub.Flag("--dry-run", &options->dry_run, "Only say how many runs it is, and about how long");
  sub.Add("-o,--output", &options->settings,
          "Where the settings that were found are written, for run --params (default: "
          "FILE.best.toml beside the file)")
      .TypeName("FILE.toml");
  sub.Add("--database", &options->output, "The database (default: FILE.sweep.db beside the file)")
      .TypeName("DB");
  sub.Add("--pick", &options->pick,
          "Which of several best candidates is written (default: the most even one)")
      .Range(1, 1'000'000);
  AddEngine(&sub, options.get());
  sub.Flag("--retry", &options->retry, "Also run those again that failed");
  sub.Force(&options->force);
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 1: no candidate fulfils all conditions, or a signal ended it.\n"
      "Example:\n  morphbus optimise faster.toml && morphbus run models/mtran.m3l "
      "walk.dyn --params faster.best.toml");
  sub.Do([options] { return Optimise(*options); });
}

}  // namespace morphbus::tools
