// morphbus sim: the simulator of a run, as a process of its own.

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <functional>
#include <utility>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/lcm_bus.h"
#include "bridge/control/control_service.h"
#include "bridge/lockstep/late_messages.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/sealed_bus.h"
#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "tools/control/control_desk.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/key_choice.h"
#include "tools/machine/wall_clock.h"
#include "tools/plan/run_plan.h"
#include "tools/plan/sense_root.h"

namespace morphbus::tools {
namespace {
/// Seconds that a run which is told to stop before it began gets to begin, so that its log has a
/// whole tick; a process that has not joined by then may never do so.
constexpr double kBeginSeconds = 1;
/// Seconds without a further HELLO after which the launcher's sim ends before it began.
constexpr int64_t kJoinS = 15;

/// The options of `morphbus sim`.
struct SimCommandOptions {
  PlanSource plan;
  int launcher_fd = -1;
  std::string
      run_folder;  ///< The run's, with what it is told beforehand; empty: takes no commands.
  std::string key_file;
  bool no_logger = false;
  double give_up_s = 60;  ///< By hand, people start one process after the other.
};

/// Through whom people act on the run: who does what they want, and who hears them.
struct SimControls {
  std::unique_ptr<ControlDesk> desk;
  std::unique_ptr<bridge::ControlService> service;  ///< None in a run started by hand.
};

/// Lets the run obey the script in its folder, and commands that bear its key.
Result<std::unique_ptr<SimControls>> MakeControls(const std::string& folder, const RunPlan& plan,
                                                  bridge::Bus* bus, LauncherLink* link,
                                                  bridge::SimParticipant* participant,
                                                  sim::ControlledRobot* robot) {
  Result<ControlScript> script = ReadScript(folder);
  if (!script) return Fail(script.error().message);
  auto controls = std::make_unique<SimControls>();
  controls->desk =
      std::make_unique<ControlDesk>(plan, std::move(*script), folder, participant, robot);
  ControlDesk* desk = controls->desk.get();
  participant->OnAfterTick([desk](int64_t tick) { desk->AfterTick(tick); });
  // A sim that was started by hand has no folder, and so neither a script nor a launcher to give
  // orders to.
  if (folder.empty()) return controls;
  // Commands come over the bus, their answers go back there, and the launcher has the processes.
  const bridge::Sender sender = {plan.description.run(), std::string(bridge::kSimProcess),
                                 plan.description.model_hash(), 0};
  controls->service = std::make_unique<bridge::ControlService>(
      bus, sender, participant->mutable_ledger(), std::bind_front(&ControlDesk::Give, desk));
  desk->OnAnswer(std::bind_front(&bridge::ControlService::Answer, controls->service.get()));
  desk->OnProcessOrder([link](const bridge::ControlCommand& command, uint32_t incarnation) {
    const bool kills = command.kind == bridge::ControlKind::kKill;
    link->Deliver({{"order", kills ? "kill" : "restart"},
                   {"module", command.part.module},
                   {"incarnation", incarnation}});
  });
  return controls;
}

/// Simulates one run and says how it ended, to the launcher or on stdout.
int Simulate(const SimCommandOptions& options) {
  if (!(options.give_up_s >= 1 && options.give_up_s <= 1e6)) {
    return Unusable("--give-up: expected 1 to 1000000 s");
  }
  const std::optional<RunPlan> plan = LoadPlan(options.plan);
  if (!plan) return kUnusable;
  Result<bridge::SimParticipantOptions> participant_options = SimOptions(*plan, !options.no_logger);
  if (!participant_options) return Unusable(participant_options.error().message);
  // The launcher has started all processes: one that is not there soon will not come.
  const bool by_hand = options.launcher_fd < 0;
  participant_options->timing.join_silence_us =
      std::llround((by_hand ? options.give_up_s : kJoinS) * 1e6);
  // The world is built before the first message: a large one takes seconds.
  const auto robot = BuildRobot(*plan);
  if (!robot) return Unusable(robot.error().message);
  const Result<std::unique_ptr<bridge::Bus>> lcm = bridge::OpenRunBus(options.plan.options.lcm_url);
  if (!lcm) return Unusable(lcm.error().message);
  const Result<bridge::RunKey> key =
      ChooseKey(plan->description.run(), plan->description.open(), options.key_file);
  if (!key) return Unusable(key.error().message);
  bridge::SealedBus sealed(lcm->get(), *key);
  bridge::MonotonicTime time;
  // Nearest to the sim are the faults, then the key, then the network: what is lost on purpose has
  // been checked before.
  bridge::FaultyBus bus(&sealed, plan->faults, bridge::kSimProcess,
                        [&time] { return time.NowUs(); });
  bridge::LateMessages late({&bus});
  bridge::SimParticipant participant(&bus, robot->get(), &time, *participant_options);
  AddRootSensor(*plan, robot->get(), &participant);
  LauncherLink link(options.launcher_fd);
  // From here on a signal ends the run at the next tick, for all its processes.
  CatchSignals();
  WallTimer since_first_tick;
  const auto controls =
      MakeControls(options.run_folder, *plan, &bus, &link, &participant, robot->get());
  if (!controls) return Unusable(controls.error().message);
  ControlDesk& desk = *(*controls)->desk;
  size_t told_gone = 0;
  participant.OnBeforeTick([&](int64_t tick) {
    desk.BeforeTick(tick);
    // A module that has left ends its process when it hears of this tick, which the launcher must
    // know before.
    const std::vector<std::string> gone = participant.GoneModules();
    if (std::exchange(told_gone, gone.size()) < gone.size()) link.Deliver({{"gone", gone}});
    if (tick == 1) since_first_tick = WallTimer();  // tick 0 waits for all to join
  });
  if (by_hand) {
    // People who start processes by hand want to know which one is missing.
    participant.OnMissing([&](const std::vector<std::string>& missing) {
      Say("morphbus: waiting for {} to join{}\n", NameSome(missing),
          bridge::UnauthenticText(sealed.unauthentic()));
    });
  }
  std::string stop;  ///< Why the run shall end; empty while it goes on.
  bool stopping = false;
  WallTimer since_stop;
  Ticker watch(kWatchUs, [&] {
    // The launcher's line brings two things: the wish to stop, and that an order about a process
    // was carried out.
    const std::string reason = StopReason(&link, [&](const Json& message) {
      if (message.contains("ordered")) desk.OrderDone(message.value("ordered", ""));
    });
    if (stop.empty()) {
      stop = reason;
      since_stop = WallTimer();
    }
    // The run ends at its next tick. Where the launcher has started all processes, it begins first.
    const bool begun = participant.tick() > 0 || since_stop.seconds() > kBeginSeconds;
    if (!stop.empty() && !stopping && (by_hand || begun)) {
      stopping = true;
      participant.RequestStop(stop);
    }
    desk.AnswerWaiting();
    link.Send({{"tick", participant.tick()}, {"gone", participant.GoneModules()}});
  });
  // This returns when the run is over: the participant is done, and the watch never keeps it.
  bridge::RunParticipants(&bus, time, {&late, &participant, &watch}, nullptr,
                          [&] { participant.PublishHealth(); });
  desk.Finish();
  const bridge::SimOutcome& outcome = participant.outcome();
  // The last word to the launcher, which waits for it: delivered, whatever else is in the socket.
  link.Deliver({{"gone", participant.GoneModules()},
                {"outcome",
                 {{"ok", outcome.ok},
                  {"error", outcome.error},
                  {"reason", outcome.reason},
                  {"ticks", outcome.ticks},
                  {"wall_seconds", since_first_tick.seconds()},
                  {"missed_deadlines", outcome.missed_deadlines}}}});
  if (by_hand) {
    Print("run {}: {} ticks, hash {}, {}\n", plan->description.run(), outcome.ticks,
          outcome.run_hash, outcome.reason);
  }
  if (outcome.ok) return kDone;
  // Under a launcher the launcher prints the error, once for all processes.
  return by_hand ? Failed(outcome.error) : kFailed;
}

}  // namespace

void AddSim(CommandLine* line) {
  Subcommand sub = line->Add("sim", "The simulator of a run, for starting by hand");
  auto options = std::make_shared<SimCommandOptions>();
  AddPlanSource(&sub, &options->plan);
  AddKeyFile(&sub, &options->key_file, "that of the run of this machine");
  sub.Flag("--no-logger", &options->no_logger, "Do not wait for a logger");
  sub.Add("--give-up", &options->give_up_s,
          "Before the first tick: end after so many seconds in which nobody joined (default 60)")
      .Seconds();
  sub.Add("--launcher-fd", &options->launcher_fd, "The launcher's line").Hidden();
  sub.Add("--run-folder", &options->run_folder, "The run's folder").Hidden();
  sub.Footer(
      "Example (three terminals, or three hosts with udpm ttl=1):\n"
      "  morphbus sim models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --run walk "
      "--seconds 30\n"
      "  morphbus log models/mtran.m3l models/programs/quadruped.dyn --robot quadruped --run walk "
      "--seconds 30 -o walk.log\n"
      "  morphbus module --run walk --module m1 ...");
  sub.Do([options] { return Simulate(*options); });
}

}  // namespace morphbus::tools
