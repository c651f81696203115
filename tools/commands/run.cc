// morphbus run: a whole robot, from source to summary.

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "bridge/bus/lcm_url.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/launch/inproc_run.h"
#include "tools/launch/launcher.h"
#include "tools/launch/launcher_link.h"
#include "tools/launch/run_outcome.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/network.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {
namespace {

/// "walk.log" as the second of several runs: "walk-2.log".
std::string LogPath(const RunOptions& options, const std::string& run, int number) {
  // Absolute, for the summary and for `morphbus runs`, which may be asked from another folder.
  namespace fs = std::filesystem;
  fs::path path = options.log.empty() ? "morphbus-" + run + ".log" : options.log;
  // Each run has a log of its own; without --log the run's name makes it so.
  if (options.repeat > 1 && !options.log.empty()) {
    path.replace_filename(
        fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string()));
  }
  return fs::absolute(path).lexically_normal();
}

/// Where this run is recorded: in a log, or in memory. Empty, after saying why, if it cannot be.
std::optional<RunRecord> RecordOf(const RunOptions& options, const std::string& run, int number) {
  if (options.no_log) {
    Result<RunRecord> memory = RunRecord::InMemory();
    if (!memory) return Refuse(memory.error().message);
    return std::move(*memory);
  }
  const std::string log = LogPath(options, run, number);
  return RunRecord::ToLog(
      log, options.force,
      {options.model_file, options.program_file, options.commands, options.faults});
}

/// One run. Returns its summary; nothing if it could not even begin (said on stderr).
std::optional<Json> RunOnce(RunPlan* plan, const RunOptions& options, int number) {
  Result<RunDirectory> directory = RunDirectory::Claim(options.run);
  if (!directory) return Refuse(directory.error().message);
  // Only what differs between repeated runs: the name and the time.
  plan->description.set_run(directory->name());
  plan->description.set_started(WallTime());
  const std::optional<RunRecord> record = RecordOf(options, directory->name(), number);
  if (!record) return std::nullopt;
  // The key is there before anybody can find the run.
  const Result<bridge::RunKey> key =
      KeyOfNewRun(options.open, options.key_file, options.inproc ? "" : directory->path());
  if (!key) return Refuse(key.error().message);
  // In one process there is no bus that others could join: the URL stays empty.
  // The entry lets spy, monitor and control find the run by its name; it goes with the directory.
  RunEntry entry{directory->name(),
                 getpid(),
                 plan->description.started(),
                 plan->robot().name,
                 record->in_memory() ? "" : record->path(),
                 "",
                 options.isolate};
  if (!options.inproc) {
    const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl(options.lcm_url);
    entry.url = url ? url->url : "";
  }
  if (Result<void> published = directory->Publish(entry); !published) {
    return Refuse(published.error().message);
  }
  // What the run was is read from what was recorded, once all processes have ended.
  RunSummary summary =
      Summarize(*plan, options.inproc ? RunInProcess(*plan, *record, *key)
                                      : Launcher(*plan, options, *directory, *record).Run());
  RunOutcome& outcome = summary.outcome;
  if (record->in_memory()) outcome.log.clear();
  if (!options.json) PrintText(SummaryText(summary));
  // The summary stands before the error on a terminal that shows both streams.
  FlushResult();
  if (!outcome.error.empty()) {
    Failed(outcome.log.empty() ? outcome.error
                               : fmt::format("{}; the log is {}", outcome.error, outcome.log));
  }
  return SummaryJson(summary);
}

/// Exit status of a run by its summary: 1 if the program has roles and no module has one at the
/// end.
int StatusOf(const Json& summary) {
  if (!summary["error"].is_null()) return kFailed;
  const Json& roles = summary["roles"];
  const bool none =
      std::all_of(roles.begin(), roles.end(), [](const Json& role) { return role.is_null(); });
  // Problems are told only of programs that have roles.
  return none && !summary["problems"].empty() ? kNo : kDone;
}

/// --repeat: the same run again and again, on logs of their own.
int RunSeveral(RunPlan* plan, const RunOptions& options) {
  Json runs = Json::array();
  bool agree = true;
  bool stopped = false;
  int status = kDone;
  while (static_cast<int>(runs.size()) < options.repeat && !stopped && status != kFailed) {
    const std::optional<Json> summary = RunOnce(plan, options, static_cast<int>(runs.size()) + 1);
    if (!summary) return kUnusable;
    status = std::max(status, StatusOf(*summary));
    runs.push_back(*summary);
    // A signal ends the run that it meets, and those that were to follow. A run that it cut short
    // has another hash for that reason.
    stopped = CaughtSignal() != 0;
    agree = agree && (stopped || runs.back()["hash"] == runs.front()["hash"]);
  }
  agree = agree && status != kFailed;
  if (!agree || stopped) status = std::max(status, kNo);
  if (options.json) {
    PrintJson({{"hashes_agree", agree}, {"stopped", stopped}, {"runs", runs}});
  } else {
    Print("{} of {} runs done{}, their hashes {}\n", runs.size(), options.repeat,
          stopped ? ", stopped by a signal in the last" : "", agree ? "agree" : "do not agree");
  }
  return status;
}

/// Checks the options, makes the plan, enters the network, and runs.
int RunRobot(const RunOptions& options) {
  // Options that exclude each other are refused before the model is compiled.
  if (options.repeat < 1 || options.repeat > 100000)
    return Unusable("--repeat: expected 1 to 100000");
  if (options.repeat > 1 && options.seconds <= 0) return Unusable("--repeat needs --seconds");
  if (options.inproc && options.processes > 0) {
    return Unusable("--inproc is one process: leave out --processes");
  }
  if (options.inproc && options.isolate) {
    return Unusable("--inproc uses no network: leave out --isolate");
  }
  for (const auto& [given, name] :
       {std::pair(!options.log.empty(), "--log"), std::pair(options.force, "--force")}) {
    if (options.no_log && given) {
      return Unusable(fmt::format("--no-log writes no log: leave out {}", name));
    }
  }
  // Models and programs with errors are refused before anything starts.
  std::optional<RunPlan> plan = PlanRun(options);
  if (!plan) return kUnusable;
  WarnOfUnreached(plan->script, plan->num_ticks());
  if (options.isolate) {
    if (Result<void> entered = EnterPrivateNetwork(); !entered)
      return Unusable(entered.error().message);
  }
  if (!options.inproc) {
    const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl(options.lcm_url);
    if (!url) return Unusable(url.error().message);
    if (Result<void> able = bridge::CheckCarriesRuns(*url); !able) {
      return Unusable(able.error().message);
    }
    // LCM would be silent where multicast has no route, and the run would wait for ever.
    if (Result<void> routed = bridge::CheckMulticastRoute(*url); !routed) {
      return Unusable(routed.error().message);
    }
  }
  // The plan is made once; repeated runs share it.
  if (options.repeat > 1) return RunSeveral(&*plan, options);
  const std::optional<Json> summary = RunOnce(&*plan, options, 1);
  if (!summary) return kUnusable;
  if (options.json) PrintJson(*summary);
  return StatusOf(*summary);
}

}  // namespace

void AddRun(CommandLine* line) {
  Subcommand sub = line->Add("run", "Run a robot: simulator, a process a module, logger");
  auto options = std::make_shared<RunOptions>();
  sub.Add("FILE.m3l", &options->model_file, "M3L file").Required();
  sub.Add("PROG.dyn", &options->program_file, "DynaRole program or image").Required();
  AddPlanOptions(&sub, options.get());
  sub.Add("-o,--log", &options->log, "Log to write (default: morphbus-<run>.log)").TypeName("FILE");
  sub.Flag("--no-log", &options->no_log, "No log: the summary is all that is left of the run");
  sub.Force(&options->force);
  sub.Flag("--inproc", &options->inproc, "All in one process, without a network; same hash");
  sub.Add("--processes", &options->processes,
          "So many processes share the modules (default: one a module)")
      .Range(1, 100'000);
  AddKeyFile(&sub, &options->key_file, "a fresh one");
  sub.Flag("--isolate", &options->isolate,
           "A private network with just a loopback; needs no rights");
  sub.Add("--commands", &options->commands,
          "Commands and the ticks at which they are given, as morphbus info --commands lists them")
      .TypeName("FILE");
  sub.Add("--lose", &options->lose,
          "Lose a module on purpose and go on without it: m3@12.5, at 12.5 s; may be repeated")
      .TypeName("MODULE@SECONDS")
      .Repeatable();
  sub.Add("--repeat", &options->repeat, "Run so often, and see whether the hashes agree");
  sub.Json(&options->json);
  sub.Footer(
      "Exit status 1: no module has a role when the run ends, or the hashes of --repeat differ.\n"
      "Examples:\n"
      "  morphbus run models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --seconds "
      "30 "
      "--isolate\n"
      "  morphbus run ... --seconds 10 --isolate --loss 0.2 --seed 7 --repeat 3\n"
      "  morphbus run ... --seconds 10 --isolate --faults models/rough.faults\n"
      "  morphbus run ... --inproc --seconds 30 --log walk.log --json\n"
      "  morphbus run ... --inproc --seconds 30 --no-log --json\n"
      "  morphbus run ... --inproc --seconds 30 --lose m3@12.5 --lose m8@20");
  sub.Do([options] { return RunRobot(*options); });
}

}  // namespace morphbus::tools
