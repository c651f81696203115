#pragma once
// The simulator's side of the lockstep: publishes clock, sensors and true poses, takes commands. It
// also decides who may take part in the run, and says at the end how the run went.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bridge/lockstep/lockstep_participant.h"
#include "bridge/lockstep/sim/module_orders.h"
#include "bridge/lockstep/sim/package_delivery.h"
#include "bridge/lockstep/sim/punctuality.h"
#include "bridge/lockstep/sim/robot_readings.h"
#include "bridge/lockstep/sim/run_ending.h"
#include "bridge/lockstep/sim/run_members.h"
#include "bridge/lockstep/sim/sim_lockstep.h"
#include "bridge/lockstep/sim/simulated_robot.h"
#include "bridge/lockstep/sim/tick_commands.h"
#include "bridge/lockstep/sim/tick_publisher.h"

namespace morphbus::bridge {

/// What the run is, and whom it needs, besides what its machine is told; `num_modules` is that of
/// `modules`.
struct SimParticipantOptions : SimLockstep::Config, ExpectedMembers {
  /// Name of the run, the first part of every channel.
  std::string run;
  /// What CLOCK says when the run has come to its last tick and nothing is wrong; empty:
  /// "finished". A run that is done again ends as the first one did.
  std::string end_reason = {};
};

/// The simulator as a participant of a run: every tick it tells what the robot senses, and moves
/// the robot once everybody has answered.
class SimParticipant : public LockstepParticipant<SimLockstep> {
 public:
  /// `bus`, `robot` and `time` outlive the participant.
  SimParticipant(Bus* bus, SimulatedRobot* robot, const TimeSource* time,
                 SimParticipantOptions options);

  /// Listens to everybody and publishes tick 0.
  void Start() override;
  /// Does what is due, and reports who is missing.
  void OnTime() override;

  /// Ends the run after the current tick; `reason` goes into CLOCK.
  void RequestStop(const std::string& reason);
  /// Holds the run between two ticks.
  void Pause() { machine_.Pause(); }
  /// Goes on after Pause.
  void Resume() { Tell(&SimLockstep::Resume); }
  /// Paused: runs so many ticks more.
  void Step(int64_t ticks = 1) { Tell(&SimLockstep::Step, ticks); }
  /// Times real time; 0: as fast as possible.
  void SetSpeed(double speed) { Tell(&SimLockstep::SetSpeed, speed); }
  /// From the next tick on the run goes on without this module (by place in `modules`): it is asked
  /// to leave, its sensors and its mates' show no connection between them, and nobody waits for it.
  /// A control that the next CLOCK names must say so (LostModule in bridge/wire/channels.h).
  void Lose(size_t module) { Tell(&SimLockstep::Lose, static_cast<int>(module)); }
  /// Whether it was lost, or will be before the next tick.
  [[nodiscard]] bool lost(size_t module) const {
    return machine_.attendance().lost(static_cast<int>(module));
  }
  /// Lockstep only: `at_barrier` is called, once, when all is there for the next tick, which waits
  /// for PassBarrier.
  void SetBarrier(std::function<void()> at_barrier) {
    at_barrier_ = std::move(at_barrier);
    machine_.SetBarrier();
  }
  void PassBarrier() { Tell(&SimLockstep::PassBarrier); }
  /// The number of a module's next incarnation, which begins now or with the next tick.
  uint32_t BeginIncarnation(size_t module) {
    return members_.BeginIncarnation(static_cast<int>(module));
  }
  /// Called when a process has taken the place of a module that left nothing behind (by place in
  /// `modules`), with the first tick that it computes.
  void OnReplaced(std::function<void(size_t module, int64_t tick)> hook) {
    replaced_ = std::move(hook);
  }
  /// Text that the next CLOCK carries among its `controls`: an effect that begins at that tick.
  void AnnounceControl(const std::string& text) { publisher_.Announce(text); }
  /// What modules are told to do with the next SENSORS.
  [[nodiscard]] ModuleOrders& orders() { return orders_; }
  /// The program that goes out to a module with SENSORS.
  [[nodiscard]] PackageDelivery& delivery() { return delivery_; }
  /// Called every LockstepTiming::report_missing_us while tick 0 waits for processes to join, with
  /// their names.
  void OnMissing(std::function<void(const std::vector<std::string>&)> report) {
    report_missing_ = std::move(report);
  }
  /// Called before sensors of a tick are published (tick number): apply controls to the robot here.
  void OnBeforeTick(std::function<void(int64_t tick)> hook) { before_tick_ = std::move(hook); }
  /// Called once a tick, when the robot is sensed: what the sensor of the root's pose measures. The
  /// module that it names gets it with its own reading.
  void OnSenseRoot(std::function<morphbus::root_pose_t()> sense) { sense_root_ = std::move(sense); }
  /// Called when the messages of a tick are out: what is given now takes effect at the next one.
  void OnAfterTick(std::function<void(int64_t tick)> hook) { after_tick_ = std::move(hook); }
  /// For who counts what comes to this process beside the lockstep (bridge/control).
  [[nodiscard]] Ledger* mutable_ledger() { return &ledger_; }

  /// Hash of the program that a module (by place in `modules`) ran when it was heard of last; 0
  /// before.
  [[nodiscard]] uint64_t program_of(size_t module) const { return commands_.program_of(module); }
  /// What the robot sensed at the tick that is out.
  [[nodiscard]] const RobotReadings& readings() const { return readings_; }
  /// The tick that is out, or the one after the last once the run is over.
  [[nodiscard]] int64_t tick() const { return machine_.tick(); }
  [[nodiscard]] bool paused() const { return machine_.paused(); }
  /// END is out, so that no tick follows.
  [[nodiscard]] bool ending() const { return machine_.ending(); }
  /// How the run ended; complete once done().
  [[nodiscard]] const SimOutcome& outcome() const { return ending_.outcome(); }
  /// Names of the modules that have left.
  [[nodiscard]] std::vector<std::string> GoneModules() const;
  /// Processes that have not said HELLO yet, for progress messages.
  [[nodiscard]] std::vector<std::string> missing_processes() const;
  /// Who takes part in the run, and who was turned away.
  [[nodiscard]] const RunMembers& members() const { return members_; }

 private:
  [[nodiscard]] Moment CurrentMoment() const override {
    return {machine_.tick(), machine_.tick() * options_.tick_us};
  }
  [[nodiscard]] std::vector<morphbus::lateness_t> Lateness() const override;
  void CarryOut(const SimAction& action) override;
  // What the bus calls with messages of others. Each is decoded and checked before the machine
  // hears of it.
  void OnHello(const uint8_t* data, size_t size);
  void OnActuator(int module, const uint8_t* data, size_t size);
  void OnResend(const uint8_t* data, size_t size);
  void OnProgress(const uint8_t* data, size_t size);
  /// A process acknowledges END, or that it leaves.
  void OnTotals(const uint8_t* data, size_t size);
  /// In real time, while a module gets a package: does it have it?
  void OnTransform(size_t module, const uint8_t* data, size_t size);
  /// Listens to the module that is to say that it has its package, and to no other one.
  void ListenForNews();
  /// Tells a module that begins while the run goes on where that is.
  void Admit(int module);
  // What a tick consists of: sensing the robot and CLOCK; SENSORS and WORLD; then the robot moves.
  void BeginTick(int64_t tick);
  void PublishReadings(int64_t tick);
  void Advance(int64_t tick);
  /// What is known now of how the run ends.
  [[nodiscard]] RunEnding::Facts EndFacts() const;
  /// Tells the logger how the run ended.
  void TellVerdict();
  /// Calls the report of OnMissing if it is due.
  void ReportMissing();
  /// Ends the run at once, with an error.
  void Refuse(const std::string& why);
  /// Whether the machine's number is that of a module, and not the logger's or a stranger's.
  [[nodiscard]] bool IsModule(int process) const {
    return process >= 0 && process < members_.num_modules();
  }

  // The robot is not owned.
  SimulatedRobot* robot_;
  SimParticipantOptions options_;
  RunMembers members_;
  TickPublisher publisher_;
  RobotReadings readings_;  ///< Of the tick that is out.
  TickCommands commands_;
  ModuleOrders orders_;
  PackageDelivery delivery_;
  /// The module that is listened to because it gets a package.
  std::optional<size_t> listened_to_;
  RunEnding ending_;
  bool verdict_told_ = false;  ///< The logger was told how the run ended, and that holds.
  /// Which modules answer late in real time.
  Punctuality punctuality_;
  /// Of the numbers of each module's ACTUATOR.
  std::vector<SequenceTracker> received_;
  morphbus::actuator_t command_;  ///< The last ACTUATOR that came and was not kept.
  // Called if set; see OnBeforeTick, OnAfterTick, SetBarrier, OnReplaced, OnSenseRoot, OnMissing.
  std::function<void(int64_t)> before_tick_, after_tick_;
  std::function<void()> at_barrier_;
  std::function<void(size_t, int64_t)> replaced_;
  std::function<morphbus::root_pose_t()> sense_root_;
  std::function<void(const std::vector<std::string>&)> report_missing_;
  int64_t report_missing_due_us_ = 0;
};

}  // namespace morphbus::bridge
