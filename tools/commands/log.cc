// morphbus log: the logger of a run, as a process of its own.

#include <fmt/format.h>

#include <random>

#include "bridge/bus/bus_adapters.h"
#include "bridge/bus/lcm_bus.h"
#include "logger/log/recorder.h"
#include "tools/commands/commands.h"
#include "tools/launch/control_link.h"
#include "tools/launch/run_plan.h"

namespace morphbus::tools {
namespace {

/// Microseconds between two looks at the launcher and at signals.
constexpr int64_t kWatchUs = 50000;

/// The options of `morphbus log`.
struct LogOptions {
  PlanSource plan;
  std::string output;
  int control_fd = -1;
};

/// What the recorder must know of the run before it hears of it.
logger::RecorderOptions RecorderFor(const RunPlan& plan, const std::string& path) {
  logger::RecorderOptions options;
  options.path = path;
  options.description = plan.description.SerializeAsString();
  options.realtime = plan.description.mode() == "realtime";
  // Tells this process from a second one that claims to be the logger; never in a hashed payload.
  std::random_device random;
  options.claim = static_cast<int64_t>(random()) + 1;
  return options;
}

/// Records until the run ends or `link` or a signal says stop. `*interrupted` says why it did.
void Record(logger::Recorder* recorder, bridge::Bus* bus, const bridge::TimeSource& time,
            ControlLink* link, std::string* interrupted) {
  volatile bool stop = false;
  Ticker watch(kWatchUs, [&] {
    if (interrupted->empty()) *interrupted = StopReason(link);
    if (!interrupted->empty()) stop = true;
  });
  bridge::RunParticipants(bus, time, {recorder, &watch}, &stop, [&] { recorder->EachSecond(); });
}

/// Records one run. Its status says whether the log is whole, unless the launcher asked for the
/// end.
int Log(const LogOptions& options) {
  const std::optional<RunPlan> plan = LoadPlan(options.plan);
  if (!plan) return kUnusable;
  const RunOptions& from = options.plan.options;
  if (!MayWriteLog(options.output, from.force, {from.model_file, from.program_file})) {
    return kUnusable;
  }
  const Result<std::unique_ptr<bridge::Bus>> lcm = bridge::OpenLcmBus(options.plan.options.lcm_url);
  if (!lcm) return Unusable(lcm.error().message);
  bridge::LossyBus bus(lcm->get(), plan->description.loss(),
                       ReceiverSeed(plan->description.seed(), kLogReceiver));
  bridge::MonotonicTime time;
  ControlLink link(options.control_fd);
  // From here on a signal ends the recording properly, with an END that names it.
  CatchSignals();
  const Result<std::unique_ptr<logger::Recorder>> recorder =
      logger::Recorder::Create(&bus, &time, RecorderFor(*plan, options.output));
  if (!recorder) return Unusable(recorder.error().message);
  std::string interrupted;
  Record(recorder->get(), &bus, time, &link, &interrupted);
  // The file is closed first and reported on afterwards: the launcher may be gone.
  const Result<logger::RecordSummary> summary = (*recorder)->Finish(interrupted);
  if (!summary) {
    link.Deliver({{"error", summary.error().message}});
    return Failed(summary.error().message);
  }
  link.Deliver(
      {{"log", summary->path}, {"complete", summary->complete}, {"reason", summary->reason}});
  if (options.control_fd < 0) {
    fmt::print("{}: {} events, {} bytes, hash {}, {}\n", summary->path, summary->events,
               summary->bytes, summary->run_hash, summary->reason);
  }
  // Told to stop by the launcher, which says itself what went wrong: closing the log was the task.
  if (!interrupted.empty() && options.control_fd >= 0) return kDone;
  return summary->complete ? kDone : Failed(summary->path + ": " + summary->reason);
}

}  // namespace

void AddLog(CommandLine* line) {
  Subcommand sub = line->Add("log", "The logger of a run, for starting by hand");
  auto options = std::make_shared<LogOptions>();
  AddPlanSource(&sub, &options->plan);
  sub.Add("-o,--log", &options->output, "Log to write").Required();
  sub.Force(&options->plan.options.force);
  sub.Add("--control-fd", &options->control_fd, "The launcher's line").Hidden();
  sub.Footer(
      "Example:\n  morphbus log models/mtran.m3l models/programs/quadruped.dyn --robot quadruped "
      "--run walk --seconds 30 -o walk.log");
  sub.Do([options] { return Log(*options); });
}

}  // namespace morphbus::tools
