#include "tools/launch/inproc_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <list>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/late_messages.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/sealed_bus.h"
#include "logger/log/recorder.h"
#include "tools/control/control_desk.h"
#include "tools/launch/launcher_link.h"
#include "tools/launch/progress.h"
#include "tools/machine/wall_clock.h"
#include "tools/plan/plan_modules.h"
#include "tools/plan/sense_root.h"

namespace morphbus::tools {
namespace {

/// A process's endpoint of the hub, with the run's key, behind the faults that --loss and --faults
/// ask for.
struct FaultyEndpoint {
  FaultyEndpoint(bridge::InprocHub* hub, const bridge::RunKey& key, const bridge::FaultPlan& faults,
                 std::string_view process, const bridge::TimeSource& time)
      : endpoint(hub->Connect()),
        sealed(endpoint.get(), key, bridge::SealedBus::Hears::kAll),
        bus(&sealed, faults, process, [&time] { return time.NowUs(); }) {}

  std::unique_ptr<bridge::Bus> endpoint;
  bridge::SealedBus sealed;
  bridge::FaultyBus bus;
};

/// Everything of one run, on one hub.
class InprocRun {
 public:
  InprocRun(const RunPlan& plan, const RunRecord& record, const bridge::RunKey& key)
      : plan_(plan), to_(record), description_(plan.description), key_(key) {}

  /// Puts everything on the hub, before the first message. Fails if a part of the plan cannot be
  /// used or the log cannot be written.
  Result<void> Build() {
    // The simulator with its robot comes first.
    Result<std::unique_ptr<sim::ControlledRobot>> robot = BuildRobot(plan_);
    if (!robot) return Fail(robot.error().message);
    robot_ = std::move(*robot);
    const Result<bridge::SimParticipantOptions> sim_options = SimOptions(plan_, true);
    if (!sim_options) return Fail(sim_options.error().message);
    sim_ = std::make_unique<bridge::SimParticipant>(Connect(bridge::kSimProcess), robot_.get(),
                                                    &time_, *sim_options);
    AddRootSensor(plan_, robot_.get(), sim_.get());
    // Without wall time here, a second of sim time stands for HEALTH's second.
    const int64_t second = std::max<int64_t>(1, 1000000 / description_.tick_us());
    desk_ = std::make_unique<ControlDesk>(plan_, plan_.script, "", sim_.get(), robot_.get());
    sim_->OnAfterTick([this](int64_t tick) { desk_->AfterTick(tick); });
    sim_->OnBeforeTick([this, second](int64_t tick) {
      desk_->BeforeTick(tick);
      if (tick == 0) since_first_tick_ = WallTimer();
      if (tick % second == 0) SendHealth();
    });
    // The modules, as morphbus-module would put them together.
    Result<std::unique_ptr<PlanModules>> modules = BuildModules(plan_);
    if (!modules) return Fail(modules.error().message);
    modules_ = std::move(*modules);
    for (const auto& module : modules_->instances) module->Join(Connect(module->name()), &time_);
    // Nobody can kill a module here, but it can begin anew all the same.
    desk_->OnProcessOrder([this](const bridge::ControlCommand& command, uint32_t incarnation) {
      const int module = *plan_.robot().FindModule(command.part.module);
      modules_->instances[module]->controller().BeginAnew(incarnation);
      desk_->OrderDone("");
    });
    // The recorder comes last, so that no message precedes the description in the log.
    logger::RecorderOptions record;
    record.path = to_.path();
    record.in_memory = to_.in_memory();
    record.description = description_.SerializeAsString();
    record.realtime = description_.mode() == "realtime";
    Result<std::unique_ptr<logger::Recorder>> recorder =
        logger::Recorder::Create(Connect(bridge::kLogProcess), &time_, record);
    if (!recorder) return Fail(recorder.error().message);
    recorder_ = std::move(*recorder);
    return {};
  }

  /// Runs until all participants are done, and closes the log. Called once, after Build.
  RunOutcome Run() {
    RunOutcome outcome;
    outcome.run = description_.run();
    // The log has this name until it is closed.
    outcome.log = to_.partial_path();
    Progress progress(plan_.robot().name, plan_.num_ticks(), description_.tick_us());
    bool stopping = false;
    bool unlogged = false;  // The log can be written no more: nothing is left to simulate for.
    Ticker watch(kWatchUs, [&] {
      progress.Show(sim_->tick());
      unlogged = !recorder_->error().empty();
      // A signal ends the run at its next tick, in order; a run that has not begun begins first.
      if (CaughtSignal() == 0 || stopping || sim_->tick() == 0) return;
      stopping = true;
      sim_->RequestStop("interrupted");
    });
    // They take turns in this thread until all are done; nobody is left waiting for what cannot
    // come.
    std::vector<bridge::FaultyBus*> buses;
    for (FaultyEndpoint& endpoint : endpoints_) buses.push_back(&endpoint.bus);
    bridge::LateMessages late(buses);
    std::vector<bridge::Participant*> participants = {&late, sim_.get(), recorder_.get(), &watch};
    for (const auto& module : modules_->instances) participants.push_back(&module->participant());
    if (!bridge::RunInproc(&hub_, &time_, participants, &unlogged) && !unlogged) {
      outcome.error = "the run came to a standstill";
    }
    // The last ledgers, for the log. In a run that was broken off messages would still beget
    // messages.
    if (!unlogged) {
      SendHealth();
      hub_.HandleAll();
      // What is still late comes before the log is closed.
      while (!late.done()) {
        time_.AdvanceTo(late.next_deadline_us());
        late.OnTime();
        hub_.HandleAll();
      }
    }
    outcome.wall_seconds = since_first_tick_.seconds();
    // The line of progress goes before the summary is printed.
    progress.Clear();
    // Closing the log may fail even after a run that went well.
    const Result<logger::RecordSummary> summary = recorder_->Finish("");
    if (summary) {
      outcome.log = summary->path;
      outcome.hash = summary->run_hash;
      // What the sim found out the log only repeats.
      const std::string& found = sim_->outcome().error;
      if (!summary->complete && outcome.error.empty())
        outcome.error = found.empty() ? "the log: " + summary->reason : found;
    } else if (outcome.error.empty()) {
      outcome.error = summary.error().message;
    }
    Gather(&outcome);
    return outcome;
  }

 private:
  /// A bus of its own for a process, with faults of its own: the same ones in every run.
  bridge::Bus* Connect(std::string_view process) {
    return &endpoints_.emplace_back(&hub_, key_, plan_.faults, process, time_).bus;
  }

  /// What each process of a run sends about once a second.
  void SendHealth() {
    sim_->PublishHealth();
    recorder_->EachSecond();
    for (const auto& module : modules_->instances) module->participant().PublishHealth();
  }

  /// How the run ended, by the sim and the modules. An earlier error stays.
  void Gather(RunOutcome* outcome) const {
    const bridge::SimOutcome& sim = sim_->outcome();
    outcome->reason = sim.reason;
    outcome->missed_deadlines = sim.missed_deadlines;
    if (!sim.ok && outcome->error.empty()) outcome->error = sim.error;
    for (const auto& module : modules_->instances) {
      const std::string& error = module->participant().error();
      if (!error.empty() && outcome->error.empty()) {
        outcome->error = "module " + module->name() + ": " + error;
      }
    }
  }

  const RunPlan& plan_;
  const RunRecord& to_;
  const proto::RunDescription& description_;
  bridge::VirtualTime time_;
  bridge::InprocHub hub_;
  bridge::RunKey key_;
  std::list<FaultyEndpoint> endpoints_;
  std::unique_ptr<PlanModules> modules_;
  std::unique_ptr<sim::ControlledRobot> robot_;
  std::unique_ptr<bridge::SimParticipant> sim_;
  std::unique_ptr<ControlDesk> desk_;
  std::unique_ptr<logger::Recorder> recorder_;
  WallTimer since_first_tick_;
};

}  // namespace

RunOutcome RunInProcess(const RunPlan& plan, const RunRecord& record, const bridge::RunKey& key) {
  CatchSignals();
  InprocRun run(plan, record, key);
  // A run that could not be put together has no log.
  if (Result<void> built = run.Build(); !built) {
    RunOutcome outcome;
    outcome.run = plan.description.run();
    outcome.error = built.error().message;
    return outcome;
  }
  return run.Run();
}

}  // namespace morphbus::tools
