#pragma once
// A whole run in one process, on the in-process bus and in virtual time: the same messages, and so
// the same hash, as with one process a module.

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/sim/sim_participant.h"
#include "bridge/wire/run_key.h"
#include "bridge/wire/sealed_bus.h"
#include "logger/log/recorder.h"
#include "sim/controlled_robot.h"
#include "tools/control/control_desk.h"
#include "tools/launch/run_outcome.h"
#include "tools/launch/run_record.h"
#include "tools/machine/wall_clock.h"
#include "tools/plan/plan_modules.h"

namespace morphbus::bridge {
class LateMessages;
}

namespace morphbus::tools {

class Ticker;

/// A run that goes on as far as somebody wants, and holds there. Its thread is that of its caller.
class InprocRun {
 public:
  /// `plan` and `record` outlive the run.
  InprocRun(const RunPlan& plan, const RunRecord& record, const bridge::RunKey& key);
  ~InprocRun();
  InprocRun(const InprocRun&) = delete;
  InprocRun& operator=(const InprocRun&) = delete;

  /// Puts everything on the hub, before the first message. Fails if a part of the plan cannot be
  /// used or the log cannot be written; then nothing else may be called.
  Result<void> Build();
  /// Called some twenty times a second of wall time while the run goes on.
  void OnWatch(std::function<void()> call) { each_watch_ = std::move(call); }
  /// Goes on until the messages of this tick are out, or to the end of the run with kNever. False
  /// once the run is over, well or not.
  bool GoOnTo(int64_t tick);
  /// Closes the log and tells how the run went. Called once, after Build.
  RunOutcome Finish();

  /// What the robot senses as it is now.
  [[nodiscard]] std::vector<morphbus::module_sensors_t> SenseNow() const;

  // The parts of the run, after Build.
  [[nodiscard]] bridge::SimParticipant& sim() { return *sim_; }
  [[nodiscard]] const bridge::SimParticipant& sim() const { return *sim_; }
  [[nodiscard]] const sim::ControlledRobot& robot() const { return *robot_; }
  [[nodiscard]] ControlDesk& desk() { return *desk_; }
  [[nodiscard]] const PlanModules& modules() const { return *modules_; }

 private:
  /// A process's endpoint of the hub, with the run's key, behind the faults that --loss and
  /// --faults ask for.
  struct Endpoint {
    Endpoint(bridge::InprocHub* hub, const bridge::RunKey& key, const bridge::FaultPlan& faults,
             std::string_view process, const bridge::TimeSource& time);

    std::unique_ptr<bridge::Bus> endpoint;
    bridge::SealedBus sealed;
    bridge::FaultyBus bus;
  };

  /// A bus of its own for a process, with faults of its own: the same ones in every run.
  bridge::Bus* Connect(std::string_view process);
  /// What each process of a run sends about once a second.
  void SendHealth();
  /// How the run ended, by the sim and the modules. An earlier error stays.
  void Gather(RunOutcome* outcome) const;

  const RunPlan& plan_;
  const RunRecord& to_;
  bridge::VirtualTime time_;
  bridge::InprocHub hub_;
  bridge::RunKey key_;
  std::list<Endpoint> endpoints_;
  std::unique_ptr<PlanModules> modules_;
  std::unique_ptr<sim::ControlledRobot> robot_;
  std::unique_ptr<bridge::SimParticipant> sim_;
  std::unique_ptr<ControlDesk> desk_;
  std::unique_ptr<logger::Recorder> recorder_;
  std::unique_ptr<bridge::LateMessages> late_;
  std::unique_ptr<Ticker> watch_;
  /// All that take turns.
  std::vector<bridge::Participant*> participants_;
  std::function<void()> each_watch_;  ///< Called if set.
  /// After which the run holds, and that it does so now; the loop looks at it between messages.
  int64_t last_tick_ = 0;
  bool held_ = false;
  bool started_ = false;
  bool over_ = false;
  std::string stuck_;  ///< Why the run could not go on; empty if it could.
  WallTimer since_first_tick_;
};

/// Runs `plan` with this key in this thread until it is over, and records it. A signal ends the run
/// cleanly. What went wrong stands in the outcome's `error`; nothing is printed but progress.
RunOutcome RunInProcess(const RunPlan& plan, const RunRecord& record, const bridge::RunKey& key);

}  // namespace morphbus::tools
