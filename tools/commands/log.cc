// morphbus log: the logger of a run, as a process of its own.

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <random>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/lcm_bus.h"
#include "bridge/lockstep/late_messages.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/sealed_bus.h"
#include "compiler/base/text.h"
#include "logger/log/recorder.h"
#include "logger/log/replay_delivery.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/run_choice.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus log`.
struct LogOptions {
  PlanSource plan;
  std::string output;
  std::string key_file;
  int launcher_fd = -1;
  bool in_memory = false;  ///< `output` is the launcher's memory (RunRecord).
  std::string follow;      ///< Name of the run whose replay is recorded; empty: none.
};

/// What the recorder must know of the run before it hears of it.
logger::RecorderOptions RecorderFor(const RunPlan& plan, const LogOptions& log) {
  logger::RecorderOptions options;
  options.path = log.output;
  options.in_memory = log.in_memory;
  options.description = plan.description.SerializeAsString();
  options.realtime = plan.description.mode() == "realtime";
  // Tells this process from a second one that claims to be the logger; never in a hashed payload.
  std::random_device random;
  options.claim = static_cast<int64_t>(random()) + 1;
  return options;
}

/// From now on this process, when a message wakes it, does not take the processor from one that is
/// at work.
void LetOthersGoFirst() {
  // Another policy than the usual one was chosen on purpose, and stays.
  const sched_param none = {};
  if (sched_getscheduler(0) == SCHED_OTHER) sched_setscheduler(0, SCHED_BATCH, &none);
}

/// Records until the run ends or `link` or a signal says stop. `*interrupted` says why it did.
void Record(logger::Recorder* recorder, bridge::FaultyBus* bus, const bridge::TimeSource& time,
            LauncherLink* link, std::string* interrupted) {
  volatile bool stop = false;
  Ticker watch(kWatchUs, [&] {
    if (interrupted->empty()) *interrupted = StopReason(link);
    if (!interrupted->empty()) stop = true;
  });
  bridge::LateMessages late({bus});
  bridge::RunParticipants(bus, time, {&late, recorder, &watch}, &stop,
                          [&] { recorder->EachSecond(); });
}

/// Records a replay: every message that it publishes, exactly once.
int Follow(const LogOptions& options) {
  const RunOptions& from = options.plan.options;
  if (!MayWriteLog(options.output, from.force, {})) return kUnusable;
  // The network is entered before there is any thread.
  const Result<std::string> url = JoinRun({from.run, from.lcm_url});
  if (!url) return Unusable(url.error().message);
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(*url);
  if (!bus) return Unusable(bus.error().message);
  if (Result<void> name = bridge::CheckRunName(options.follow); !name) {
    return Unusable("--follow: " + name.error().message);
  }
  const auto writer = logger::EventLogWriter::Create(options.output);
  if (!writer) return Unusable(writer.error().message);
  CatchSignals();
  // The first failure to write ends the recording.
  Result<void> written;
  logger::ReplayFollower follower(bus->get(), options.follow, fmt::format("F{}", getpid()),
                                  [&](std::string_view channel, std::span<const uint8_t> data) {
                                    if (written)
                                      written =
                                          (*writer)->Write(logger::WallClockUs(), channel, data);
                                  });
  const bridge::MonotonicTime time;
  while (!follower.finished() && !follower.abandoned() && written && CaughtSignal() == 0) {
    follower.Advance(time.NowUs());
    (*bus)->Handle(50);
  }
  // What came is kept, however it ended.
  if (written) written = (*writer)->Close();
  if (!written) return Failed(written.error().message);
  Print("{}: {}, {} asked for again\n", options.output, Counted(follower.delivered(), "message"),
        Counted(follower.asked_again(), "batch", "batches"));
  if (follower.abandoned()) return Failed("the replay fell silent before its end");
  return follower.finished() ? kDone : Failed("stopped before the replay's end");
}

/// Records one run. Its status says whether the log is whole, unless the launcher asked for the
/// end.
int Log(const LogOptions& options) {
  const std::optional<RunPlan> plan = LoadPlan(options.plan);
  if (!plan) return kUnusable;
  const RunOptions& from = options.plan.options;
  if (!options.in_memory &&
      !MayWriteLog(options.output, from.force, {from.model_file, from.program_file, from.faults})) {
    return kUnusable;
  }
  const Result<std::unique_ptr<bridge::Bus>> lcm = bridge::OpenRunBus(options.plan.options.lcm_url);
  if (!lcm) return Unusable(lcm.error().message);
  // In lockstep the run waits for modules and simulator, and the log may be some ticks behind.
  if (plan->description.mode() != "realtime") LetOthersGoFirst();
  const Result<bridge::RunKey> key =
      ChooseKey(plan->description.run(), plan->description.open(), options.key_file);
  if (!key) return Unusable(key.error().message);
  bridge::SealedBus sealed(lcm->get(), *key);
  bridge::MonotonicTime time;
  bridge::FaultyBus bus(&sealed, plan->faults, bridge::kLogProcess,
                        [&time] { return time.NowUs(); });
  LauncherLink link(options.launcher_fd);
  // From here on a signal ends the recording properly, with an END that names it.
  CatchSignals();
  const Result<std::unique_ptr<logger::Recorder>> recorder =
      logger::Recorder::Create(&bus, &time, RecorderFor(*plan, options));
  if (!recorder) return Unusable(recorder.error().message);
  std::string interrupted;
  Record(recorder->get(), &bus, time, &link, &interrupted);
  // The file is closed first and reported on afterwards: the launcher may be gone.
  const Result<logger::RecordSummary> summary = (*recorder)->Finish(interrupted);
  if (!summary) {
    link.Deliver({{"error", summary.error().message}});
    return Failed(summary.error().message);
  }
  link.Deliver({{"log", summary->path},
                {"hash", summary->run_hash},
                {"complete", summary->complete},
                {"reason", summary->reason}});
  // A logger that was started by hand tells people; the launcher prints one summary for all
  // processes.
  if (options.launcher_fd < 0) {
    Print("{}: {} events, {} bytes, hash {}, {}\n", summary->path, summary->events, summary->bytes,
          summary->run_hash, summary->reason);
  }
  // Told to stop by the launcher, which says itself what went wrong: closing the log was the task.
  if (!interrupted.empty() && options.launcher_fd >= 0) return kDone;
  if (summary->complete) return kDone;
  // Under a launcher the launcher prints the reason, once, and names the log.
  return options.launcher_fd >= 0 ? kFailed : Failed(summary->path + ": " + summary->reason);
}

}  // namespace

void AddLog(CommandLine* line) {
  Subcommand sub = line->Add("log", "The logger of a run, for starting by hand");
  auto options = std::make_shared<LogOptions>();
  AddPlanSource(&sub, &options->plan);
  AddKeyFile(&sub, &options->key_file, "that of the run of this machine");
  sub.Add("-o,--log", &options->output, "Log to write").TypeName("FILE").Required();
  sub.Add("--follow", &options->follow,
          "Record a replay of the run NAME instead, every message exactly once; --run names the "
          "replay's network (morphbus runs)")
      .TypeName("RUN");
  sub.Force(&options->plan.options.force);
  sub.Flag("--in-memory", &options->in_memory, "The log is the launcher's memory").Hidden();
  sub.Add("--launcher-fd", &options->launcher_fd, "The launcher's line").Hidden();
  sub.Footer(
      "Example:\n  morphbus log models/mtran.m3l models/programs/quadruped.dyn --robot quadruped "
      "--run walk --seconds 30 -o walk.log\n"
      "  morphbus log --follow walk -o part.log &\n"
      "  morphbus replay walk.log --from 5 --to 10 --speed 0 --wait-for 1");
  sub.Do([options] { return options->follow.empty() ? Log(*options) : Follow(*options); });
}

}  // namespace morphbus::tools
