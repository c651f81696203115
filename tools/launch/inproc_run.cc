#include "tools/launch/inproc_run.h"

#include <algorithm>
#include <utility>

#include "bridge/lockstep/late_messages.h"
#include "bridge/wire/channels.h"
#include "tools/launch/launcher_link.h"
#include "tools/launch/progress.h"
#include "tools/plan/sense_root.h"

namespace morphbus::tools {

InprocRun::Endpoint::Endpoint(bridge::InprocHub* hub, const bridge::RunKey& key,
                              const bridge::FaultPlan& faults, std::string_view process,
                              const bridge::TimeSource& time)
    : endpoint(hub->Connect()),
      sealed(endpoint.get(), key, bridge::SealedBus::Hears::kAll),
      bus(&sealed, faults, process, [&time] { return time.NowUs(); }) {}

InprocRun::InprocRun(const RunPlan& plan, const RunRecord& record, const bridge::RunKey& key)
    : plan_(plan), to_(record), key_(key) {}

InprocRun::~InprocRun() = default;

bridge::Bus* InprocRun::Connect(std::string_view process) {
  return &endpoints_.emplace_back(&hub_, key_, plan_.faults, process, time_).bus;
}

Result<void> InprocRun::Build() {
  const proto::RunDescription& description = plan_.description;
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
  const int64_t second = std::max<int64_t>(1, 1000000 / description.tick_us());
  desk_ = std::make_unique<ControlDesk>(plan_, plan_.script, "", sim_.get(), robot_.get());
  sim_->OnAfterTick([this](int64_t tick) {
    desk_->AfterTick(tick);
    if (tick >= last_tick_) held_ = true;
  });
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
    if (!command.cold) return desk_->OrderDone("");
    const int module = *plan_.robot().FindModule(command.part.module);
    modules_->instances[module]->controller().BeginAnew(incarnation);
    desk_->OrderDone("");
  });
  // The recorder comes last, so that no message precedes the description in the log.
  logger::RecorderOptions record;
  record.path = to_.path();
  record.in_memory = to_.in_memory();
  record.description = description.SerializeAsString();
  record.realtime = description.mode() == "realtime";
  Result<std::unique_ptr<logger::Recorder>> recorder =
      logger::Recorder::Create(Connect(bridge::kLogProcess), &time_, record);
  if (!recorder) return Fail(recorder.error().message);
  recorder_ = std::move(*recorder);
  // They take turns in this thread until all are done; nobody is left waiting for what cannot come.
  std::vector<bridge::FaultyBus*> buses;
  for (Endpoint& endpoint : endpoints_) buses.push_back(&endpoint.bus);
  late_ = std::make_unique<bridge::LateMessages>(buses);
  // Once the log can be written no more, nothing is left to simulate for.
  watch_ = std::make_unique<Ticker>(kWatchUs, [this] {
    if (!recorder_->error().empty()) held_ = true;
    if (each_watch_) each_watch_();
  });
  participants_ = {late_.get(), sim_.get(), recorder_.get(), watch_.get()};
  for (const auto& module : modules_->instances) participants_.push_back(&module->participant());
  return {};
}

bool InprocRun::GoOnTo(int64_t tick) {
  if (over_) return false;
  last_tick_ = tick;
  held_ = started_ && tick <= sim_->tick();
  const auto go_on = std::exchange(started_, true) ? bridge::ContinueInproc : bridge::RunInproc;
  const bool done = go_on(&hub_, &time_, participants_, &held_);
  if (!done && !held_) stuck_ = "the run came to a standstill";
  over_ = done || !held_ || !recorder_->error().empty();
  return !over_;
}

std::vector<morphbus::module_sensors_t> InprocRun::SenseNow() const {
  std::vector<morphbus::module_sensors_t> now;
  robot_->Sense(&now);
  return now;
}

RunOutcome InprocRun::Finish() {
  RunOutcome outcome;
  outcome.run = plan_.description.run();
  // The log has this name until it is closed.
  outcome.log = to_.partial_path();
  outcome.error = stuck_;
  // The last ledgers, for the log. In a run that was broken off messages would still beget
  // messages.
  if (recorder_->error().empty()) {
    SendHealth();
    hub_.HandleAll();
    // What is still late comes before the log is closed.
    while (!late_->done()) {
      time_.AdvanceTo(late_->next_deadline_us());
      late_->OnTime();
      hub_.HandleAll();
    }
  }
  outcome.wall_seconds = since_first_tick_.seconds();
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

void InprocRun::SendHealth() {
  sim_->PublishHealth();
  recorder_->EachSecond();
  for (const auto& module : modules_->instances) module->participant().PublishHealth();
}

void InprocRun::Gather(RunOutcome* outcome) const {
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
  Progress progress(plan.robot().name, plan.num_ticks(), plan.description.tick_us());
  bool stopping = false;
  run.OnWatch([&] {
    progress.Show(run.sim().tick());
    // A signal ends the run at its next tick, in order; a run that has not begun begins first.
    if (CaughtSignal() == 0 || stopping || run.sim().tick() == 0) return;
    stopping = true;
    run.sim().RequestStop("interrupted");
  });
  run.GoOnTo(bridge::kNever);
  RunOutcome outcome = run.Finish();
  // The line of progress goes before the summary is printed.
  progress.Clear();
  return outcome;
}

}  // namespace morphbus::tools
