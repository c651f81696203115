#include "tools/inproc_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <list>

#include "bridge/bus_adapters.h"
#include "bridge/channels.h"
#include "bridge/health.h"
#include "bridge/inproc_bus.h"
#include "bridge/module_party.h"
#include "bridge/vm_brain.h"
#include "logger/recorder.h"
#include "tools/control_link.h"
#include "tools/health_sender.h"
#include "tools/program.h"
#include "tools/progress.h"
#include "tools/wall_clock.h"

namespace morphbus::tools {
namespace {

constexpr int64_t kWatchUs = 50000;

/// A receiver's place on the hub, losing what --loss says.
struct Seat {
  Seat(bridge::InprocHub* hub, double loss, uint64_t seed)
      : endpoint(hub->Connect()), lossy(endpoint.get(), loss, seed, &discarded) {}

  int64_t discarded = 0;
  std::unique_ptr<bridge::Bus> endpoint;
  bridge::LossyBus lossy;
};

struct Module {
  Module(std::string module_name, bridge::InprocHub* hub, double loss, uint64_t seed)
      : name(std::move(module_name)), seat(hub, loss, seed) {}

  std::string name;
  Seat seat;
  std::unique_ptr<vm::VerifiedProgram> program;
  std::unique_ptr<vm::VerifiedKinematics> kinematics;
  std::unique_ptr<bridge::VmBrain> brain;
  std::unique_ptr<bridge::ModuleParty> party;
};

/// Everything of one run, on one hub.
class InprocRun {
 public:
  explicit InprocRun(const RunPlan& plan) : plan_(plan), description_(plan.description) {}

  Result<void> Build(const std::string& log);
  RunOutcome Run(const std::string& log);

 private:
  Seat* AddSeat(int receiver);
  Result<void> AddModule(size_t module);
  void SendHealth();
  void Gather(RunOutcome* outcome) const;

  const RunPlan& plan_;
  const proto::RunDescription& description_;
  bridge::VirtualTime time_;
  bridge::InprocHub hub_;
  std::list<Seat> seats_;
  std::list<Module> modules_;
  std::unique_ptr<sim::SimulatedAssembly> robot_;
  std::unique_ptr<bridge::SimParty> sim_;
  std::list<HealthSender> health_;  ///< Of the simulator, the logger, each module.
  std::unique_ptr<logger::Recorder> recorder_;
  WallTimer since_first_tick_;
};

Seat* InprocRun::AddSeat(int receiver) {
  seats_.emplace_back(&hub_, description_.loss(), ReceiverSeed(description_.seed(), receiver));
  return &seats_.back();
}

Result<void> InprocRun::AddModule(size_t index) {
  const model::Robot& robot = plan_.robot();
  const model::ModuleInstance& instance = robot.modules[index];
  const int receiver = kFirstModuleReceiver + static_cast<int>(index);
  Module& module = modules_.emplace_back(instance.name, &hub_, description_.loss(),
                                         ReceiverSeed(description_.seed(), receiver));
  const std::string& type = plan_.model.TypeOf(robot, static_cast<int>(index)).name;
  Result<std::unique_ptr<vm::VerifiedProgram>> program =
      VerifyProgram(description_.program_image());
  if (!program) return Fail(program.error().message);
  module.program = std::move(*program);
  Result<std::unique_ptr<vm::VerifiedKinematics>> kinematics =
      VerifyKinematicsImage(plan_.kinematics(type));
  if (!kinematics) return Fail(kinematics.error().message);
  module.kinematics = std::move(*kinematics);

  vm::VmConfig config;
  config.module_id = static_cast<uint16_t>(index);
  config.is_root = instance.name == description_.root_module();
  if (config.is_root) {
    const RootPose root = RootPoseOf(plan_, static_cast<int>(index));
    config.root_link = static_cast<uint8_t>(root.link);
    config.X_RL_root = ToVmPose(root.X_RL);
  }
  module.brain = std::make_unique<bridge::VmBrain>(config, *module.kinematics, *module.program);

  bridge::ModulePartyOptions options;
  options.run = description_.run();
  options.module = instance.name;
  options.module_id = config.module_id;
  options.type_name = type;
  options.num_joints = module.kinematics->num_joints();
  options.num_connectors = module.kinematics->num_connectors();
  options.model_hash = description_.model_hash();
  options.kinematics_hash = module.kinematics->hash();
  options.program_hash = module.program->hash();
  options.build = description_.build();
  module.party = std::make_unique<bridge::ModuleParty>(&module.seat.lossy, module.brain.get(),
                                                       &time_, options);
  return {};
}

Result<void> InprocRun::Build(const std::string& log) {
  Result<std::unique_ptr<sim::SimulatedAssembly>> robot = BuildAssembly(plan_);
  if (!robot) return Fail(robot.error().message);
  robot_ = std::move(*robot);
  const Result<bridge::SimPartyOptions> sim_options = SimOptions(plan_, true);
  if (!sim_options) return Fail(sim_options.error().message);
  sim_ = std::make_unique<bridge::SimParty>(&AddSeat(kSimReceiver)->lossy, robot_.get(), &time_,
                                            *sim_options);
  // Without wall time here, a second of sim time stands for HEALTH's second.
  const int64_t second = std::max<int64_t>(1, 1000000 / description_.tick_us());
  sim_->OnBeforeTick([this, second](int64_t tick) {
    if (tick == 0) since_first_tick_ = WallTimer();
    if (tick % second == 0) SendHealth();
  });
  for (size_t m = 0; m < plan_.robot().modules.size(); ++m) {
    if (Result<void> added = AddModule(m); !added) return added;
  }
  logger::RecorderOptions record;
  record.path = log;
  record.description = description_.SerializeAsString();
  Result<std::unique_ptr<logger::Recorder>> recorder =
      logger::Recorder::Create(&AddSeat(kLogReceiver)->lossy, &time_, record);
  if (!recorder) return Fail(recorder.error().message);
  recorder_ = std::move(*recorder);
  health_.emplace_back(&seats_.front().lossy, plan_, std::string(bridge::kSimProcess));
  health_.emplace_back(&seats_.back().lossy, plan_, std::string(bridge::kLogProcess));
  for (Module& module : modules_) health_.emplace_back(&module.seat.lossy, plan_, module.name);
  return {};
}

void InprocRun::SendHealth() {
  auto sender = health_.begin();
  (sender++)->Send(sim_->ledger(), seats_.front().discarded);
  (sender++)->Send(recorder_->ledger(), seats_.back().discarded);
  for (const Module& module : modules_) {
    (sender++)->Send(module.party->ledger(), module.seat.discarded);
  }
}

void InprocRun::Gather(RunOutcome* outcome) const {
  const bridge::SimOutcome& sim = sim_->outcome();
  outcome->ticks = sim.ticks;
  outcome->hash = sim.run_hash;
  outcome->reason = sim.reason;
  outcome->messages = sim.messages;
  if (!sim.ok && outcome->error.empty()) outcome->error = sim.error;
  const auto add = [&](const std::string& process, const bridge::Ledger& ledger,
                       int64_t discarded) {
    morphbus::health_t health = bridge::MakeHealth(process, ledger);
    health.discarded = discarded;
    outcome->health[process] = health;
  };
  add(std::string(bridge::kSimProcess), sim_->ledger(), seats_.front().discarded);
  add(std::string(bridge::kLogProcess), recorder_->ledger(), seats_.back().discarded);
  for (const Module& module : modules_) {
    add(module.name, module.party->ledger(), module.seat.discarded);
    if (!module.party->error().empty() && outcome->error.empty()) {
      outcome->error = "module " + module.name + ": " + module.party->error();
    }
  }
}

RunOutcome InprocRun::Run(const std::string& log) {
  RunOutcome outcome;
  outcome.run = description_.run();
  outcome.log = log + ".partial";
  Progress progress(plan_.robot().name, plan_.num_ticks(), description_.tick_us());
  bool stopping = false;
  Ticker watch(kWatchUs, [&] {
    progress.Show(sim_->tick());
    if (CaughtSignal() == 0 || stopping) return;
    stopping = true;
    sim_->RequestStop("interrupted");
  });
  std::vector<bridge::Party*> parties = {sim_.get(), recorder_.get(), &watch};
  for (Module& module : modules_) parties.push_back(module.party.get());
  if (!bridge::RunInproc(&hub_, &time_, parties)) outcome.error = "the run came to a standstill";
  outcome.wall_seconds = since_first_tick_.seconds();
  progress.Clear();
  const Result<logger::RecordSummary> summary = recorder_->Finish("");
  if (summary) {
    outcome.log = summary->path;
    if (!summary->complete && outcome.error.empty()) outcome.error = "the log: " + summary->reason;
  } else if (outcome.error.empty()) {
    outcome.error = summary.error().message;
  }
  Gather(&outcome);
  return outcome;
}

}  // namespace

RunOutcome RunInProcess(const RunPlan& plan, const std::string& log) {
  CatchSignals();
  InprocRun run(plan);
  if (Result<void> built = run.Build(log); !built) {
    RunOutcome outcome;
    outcome.run = plan.description.run();
    outcome.error = built.error().message;
    return outcome;
  }
  return run.Run(log);
}

}  // namespace morphbus::tools
