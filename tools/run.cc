// morphbus run: a whole robot, from source to summary.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "bridge/lcm_url.h"
#include "tools/commands.h"
#include "tools/inproc_run.h"
#include "tools/launcher.h"
#include "tools/network.h"
#include "tools/run_outcome.h"
#include "tools/run_plan.h"
#include "tools/run_registry.h"

namespace morphbus::tools {
namespace {

/// "walk.log" as the second of several runs: "walk-2.log".
std::string LogPath(const RunOptions& options, const std::string& run, int number) {
  namespace fs = std::filesystem;
  fs::path path = options.log.empty() ? "morphbus-" + run + ".log" : options.log;
  if (options.repeat > 1 && !options.log.empty()) {
    path.replace_filename(
        fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string()));
  }
  return fs::absolute(path).lexically_normal();
}

/// Why the log cannot be written; empty if it can. Found out before anything starts: the logger
/// itself would find out when the others wait for it.
std::string WhyNoLog(const std::string& log) {
  const std::string folder = std::filesystem::path(log).parent_path();
  if (access(folder.c_str(), W_OK | X_OK) != 0) return std::strerror(errno);
  // What the log is called in the end, and while it is written.
  for (const std::string& path : {log, log + ".partial"}) {
    std::error_code unknown;
    const std::filesystem::file_status status = std::filesystem::status(path, unknown);
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
      return path + (std::filesystem::is_directory(status) ? " is a folder" : " is no file") +
             "; --log takes the name of a file";
    }
  }
  return "";
}

/// True if the log can be written; else says why not.
bool CheckLog(const std::string& log) {
  const std::string why = WhyNoLog(log);
  if (!why.empty()) Unusable(fmt::format("cannot write {}: {}", log, why));
  return why.empty();
}

/// One run. Returns its summary; nothing if it could not even begin (said on stderr).
std::optional<Json> RunOnce(RunPlan* plan, const RunOptions& options, int number) {
  Result<RunDirectory> directory = RunDirectory::Claim(options.run);
  if (!directory) {
    Unusable(directory.error().message);
    return std::nullopt;
  }
  plan->description.set_run(directory->name());
  plan->description.set_started(WallTime());
  const std::string log = LogPath(options, directory->name(), number);
  if (!CheckLog(log) || !SparesInputs(log, {options.model_file, options.program_file})) {
    return std::nullopt;
  }
  RunEntry entry{directory->name(),  getpid(), plan->description.started(),
                 plan->robot().name, log,      "",
                 options.isolate};
  if (!options.inproc) {
    const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl(options.lcm_url);
    entry.url = url ? url->url : "";
  }
  if (Result<void> published = directory->Publish(entry); !published) {
    Unusable(published.error().message);
    return std::nullopt;
  }
  const RunOutcome outcome =
      options.inproc ? RunInProcess(*plan, log) : Launcher(*plan, options, *directory, log).Run();
  const Json summary = SummaryJson(*plan, outcome);
  if (!options.json) fmt::print("{}", SummaryText(summary, outcome));
  std::fflush(stdout);
  if (!outcome.error.empty()) {
    Failed(outcome.log.empty() ? outcome.error
                               : fmt::format("{}; the log is {}", outcome.error, outcome.log));
  }
  return summary;
}

/// Exit status of a run by its summary.
int StatusOf(const Json& summary) { return summary["error"].is_null() ? kDone : kFailed; }

int RunSeveral(RunPlan* plan, const RunOptions& options) {
  Json runs = Json::array();
  bool agree = true;
  int status = kDone;
  for (int i = 1; i <= options.repeat && status == kDone; ++i) {
    const std::optional<Json> summary = RunOnce(plan, options, i);
    if (!summary) return kUnusable;
    status = StatusOf(*summary);
    runs.push_back(*summary);
    agree = agree && runs.back()["hash"] == runs.front()["hash"];
  }
  agree = agree && status == kDone;
  if (options.json) {
    PrintJson({{"hashes_agree", agree}, {"runs", runs}});
  } else {
    fmt::print("{} of {} runs done, their hashes {}\n", runs.size(), options.repeat,
               agree ? "agree" : "do not agree");
  }
  return status != kDone ? status : (agree ? kDone : kNo);
}

int RunRobot(const RunOptions& options) {
  if (options.repeat < 1 || options.repeat > 100000)
    return Unusable("--repeat: expected 1 to 100000");
  if (options.repeat > 1 && options.seconds <= 0) return Unusable("--repeat needs --seconds");
  if (options.inproc && options.isolate) {
    return Unusable("--inproc uses no network: leave out --isolate");
  }
  std::optional<RunPlan> plan = PlanRun(options);
  if (!plan) return kUnusable;
  if (options.isolate) {
    if (Result<void> entered = EnterPrivateNetwork(); !entered)
      return Unusable(entered.error().message);
  }
  if (!options.inproc) {
    const Result<bridge::LcmUrl> url = bridge::ResolveLcmUrl(options.lcm_url);
    if (!url) return Unusable(url.error().message);
    if (Result<void> routed = bridge::CheckMulticastRoute(*url); !routed) {
      return Unusable(routed.error().message);
    }
  }
  if (options.repeat > 1) return RunSeveral(&*plan, options);
  const std::optional<Json> summary = RunOnce(&*plan, options, 1);
  if (!summary) return kUnusable;
  if (options.json) PrintJson(*summary);
  return StatusOf(*summary);
}

}  // namespace

void AddRun(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("run", "Run a robot: simulator, a process a module, logger");
  auto options = std::make_shared<RunOptions>();
  sub->add_option("FILE", options->model_file, "M3L file")->required();
  sub->add_option("PROGRAM", options->program_file, "DynaRole program or image")->required();
  AddPlanOptions(sub, options.get());
  sub->add_option("--log", options->log, "Log to write (default: morphbus-<run>.log)");
  sub->add_flag("--inproc", options->inproc, "All in one process, without a network; same hash");
  sub->add_flag("--isolate", options->isolate,
                "A private network with just a loopback; needs no rights");
  sub->add_option("--repeat", options->repeat, "Run so often, and see whether the hashes agree");
  sub->add_flag("--json", options->json, "One JSON object on stdout");
  sub->footer(
      "Examples:\n"
      "  morphbus run models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --seconds "
      "30 "
      "--isolate\n"
      "  morphbus run ... --seconds 10 --isolate --loss 0.2 --seed 7 --repeat 3\n"
      "  morphbus run ... --inproc --seconds 30 --log walk.log --json");
  sub->callback([options, action] { *action = [options] { return RunRobot(*options); }; });
}

}  // namespace morphbus::tools
