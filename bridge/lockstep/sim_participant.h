#pragma once
// The simulator's side of the lockstep: publishes clock, sensors and true poses, takes commands. It
// also decides who may take part in the run, and says at the end how the run went.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/hello_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bridge/lockstep/lockstep_participant.h"
#include "bridge/lockstep/sim_lockstep.h"
#include "bridge/lockstep/simulated_robot.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// A module that must join before tick 0 is over.
struct ExpectedModule {
  /// Name and number of the module in the model, by which it says HELLO and sends.
  std::string name;
  uint16_t id = 0;
  /// Its type, and the hash of that type's kinematics image: HELLO must name the same.
  std::string type_name;
  uint64_t kinematics_hash = 0;
  int num_connectors = vm::kMaxNeighbours;  ///< Of its type; fewer make smaller SENSORS.
};

/// What the run is, and whom it needs, besides what its machine is told; `num_modules` is that of
/// `modules`.
struct SimParticipantOptions : SimLockstep::Config {
  /// Name of the run, the first part of every channel.
  std::string run;
  /// Hash of the model, which every process must name.
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;            ///< Of the image every module must run; 0: any.
  std::vector<ExpectedModule> modules;  ///< In order of id.
};

/// How a run ended, for the summary; read it once the participant is done.
struct SimOutcome {
  /// The run ended as planned, everybody acknowledged it, and the hashes agree.
  bool ok = false;
  std::string error;   ///< Empty if ok; names the process concerned.
  std::string reason;  ///< As in CLOCK's end_reason.
  /// Ticks that were computed to their end.
  int64_t ticks = 0;
  std::string run_hash;       ///< 32 hexadecimal digits; empty if a module did not acknowledge END.
  std::string recorded_hash;  ///< The logger's; empty without one.
  /// Counts and hashes of all hashed channels, in order of name.
  std::vector<ChannelTotal> totals;
  int64_t messages = 0;  ///< Distinct messages on hashed channels.
  /// Real time: commands that came too late.
  int64_t missed_deadlines = 0;
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
  /// Text that the next CLOCK carries among its `controls`: an effect that begins at that tick.
  void AnnounceControl(const std::string& text);
  /// Gives a module (by place in `modules`) an invocation to issue, with the next tick that has
  /// room.
  void Invoke(size_t module, const vm::InvokeRequest& request);
  /// Gives a module a new program, from where it spreads: one piece a tick. `image` is verified by
  /// the caller and at most vm::kMaxImageBytes; a deployment under way is finished first.
  void Deploy(size_t module, uint64_t hash, const std::vector<uint8_t>& image);
  /// Called every LockstepTiming::report_missing_us while tick 0 waits for processes to join, with
  /// their names.
  void OnMissing(std::function<void(const std::vector<std::string>&)> report) {
    report_missing_ = std::move(report);
  }
  /// Called before sensors of a tick are published (tick number): apply controls to the robot here.
  void OnBeforeTick(std::function<void(int64_t tick)> hook) { before_tick_ = std::move(hook); }
  /// Called when the messages of a tick are out: what is given now takes effect at the next one.
  void OnAfterTick(std::function<void(int64_t tick)> hook) { after_tick_ = std::move(hook); }
  /// For who counts what comes to this process beside the lockstep (bridge/control).
  [[nodiscard]] Ledger* mutable_ledger() { return &ledger_; }
  /// Hash of the program that a module (by place in `modules`) ran when it was heard of last; 0
  /// before.
  [[nodiscard]] uint64_t program_of(size_t module) const {
    return static_cast<uint64_t>(commands_[module].header.program_hash);
  }

  /// The tick that is out, or the one after the last once the run is over.
  [[nodiscard]] int64_t tick() const { return machine_.tick(); }
  [[nodiscard]] bool paused() const { return machine_.paused(); }
  /// END is out, so that no tick follows.
  [[nodiscard]] bool ending() const { return machine_.ending(); }
  /// How the run ended; complete once done().
  [[nodiscard]] const SimOutcome& outcome() const { return outcome_; }
  /// Processes that have not said HELLO yet, for progress messages.
  [[nodiscard]] std::vector<std::string> missing_processes() const;
  /// Processes that were turned away without harm to the run, one sentence each (at most 16 are
  /// kept).
  [[nodiscard]] const std::vector<std::string>& turned_away() const { return turned_away_; }

 private:
  [[nodiscard]] Moment CurrentMoment() const override {
    return {machine_.tick(), machine_.tick() * options_.tick_us};
  }
  void CarryOut(const SimAction& action) override;
  // What the bus calls with messages of others. Each is decoded and checked before the machine
  // hears of it.
  void OnHello(const uint8_t* data, size_t size);
  void OnActuator(size_t module, const uint8_t* data, size_t size);
  void OnAsk(const uint8_t* data, size_t size);
  /// END was acknowledged: notes what the process says of the run.
  void TakeEndAck(int process, const morphbus::ask_t& ask);
  /// The machine's number of a process of this run; -1 for others.
  int ProcessNumber(const std::string& name) const;
  /// Empty, or why the process does not fit the run, as a sentence. (sim_participant_checks.cc)
  std::string HelloError(int process, const morphbus::hello_t& hello) const;
  /// Senses the robot and publishes CLOCK, SENSORS and WORLD.
  void PublishTick(int64_t tick);
  /// The parts of PublishTick; PublishClock also publishes END.
  void PublishClock(int64_t tick, int8_t phase);
  void PublishSensors(int64_t tick);
  /// Adds as many requests and pieces of programs for the modules of a part of SENSORS as there is
  /// room for, and takes them off the queues.
  void AddOrders(size_t part, morphbus::sensors_t* sensors);
  void PublishWorld(int64_t tick);
  /// Sends the messages of a tick on a channel with `parts` messages a tick again.
  void Repeat(const std::string& channel, int64_t tick, int parts);
  /// Applies the commands and moves the robot by a tick.
  void Advance();
  /// Who kept silent too long, as a sentence; empty while all is well.
  [[nodiscard]] std::string SilentText() const;
  /// Works out how the run ended, as far as is known now.
  void Conclude();
  /// Tells the logger how the run ended (KIND_VERDICT).
  void TellVerdict();
  /// Calls the report of OnMissing if it is due.
  void ReportMissing();
  /// Ends the run at once, with an error.
  void Refuse(const std::string& why);
  /// Empty, or why these sensors cannot be told to anybody: then the run ends at once.
  /// (sim_participant_checks.cc)
  std::string WhyUnusable() const;

  // The robot is not owned.
  SimulatedRobot* robot_;
  SimParticipantOptions options_;
  SimOutcome outcome_;
  std::string refusal_;  ///< Why the run was ended at once; empty while all is well.
  // Full names of the channels that the sim publishes every tick.
  std::string channel_clock_, channel_sensors_, channel_world_;
  std::vector<std::string> names_;  ///< Machine's process index -> name; the logger last.
  std::vector<int64_t> claims_;     ///< By process; 0: none yet.
  std::vector<morphbus::actuator_t> commands_;      ///< By module, of the current tick.
  std::vector<std::vector<size_t>> sensors_parts_;  ///< Indices of modules, constant over the run.
  /// Messages on WORLD a tick, constant over the run.
  int world_parts_ = 0;
  /// What the modules said of their own channels with KIND_END_ACK, by full name.
  std::map<std::string, ChannelTotal> module_totals_;
  std::vector<std::string> turned_away_;
  /// Announcements that no CLOCK has carried yet.
  std::vector<std::string> controls_;
  /// A program on its way to the module from where it spreads.
  struct Deployment {
    /// Place in `modules` of the module that gets it.
    size_t module = 0;
    /// Hash of the image, by which its pieces are told from others'.
    uint64_t hash = 0;
    std::vector<uint8_t> image;
    /// Bytes that have gone out.
    size_t sent = 0;
  };
  // Orders that wait for a tick that has room for them, oldest first.
  std::deque<std::pair<size_t, vm::InvokeRequest>> requests_;
  std::deque<Deployment> deployments_;
  // Called if set; see OnBeforeTick, OnAfterTick and OnMissing.
  std::function<void(int64_t)> before_tick_, after_tick_;
  std::function<void(const std::vector<std::string>&)> report_missing_;
  int64_t report_missing_due_us_ = 0;
  // What the robot told of the tick that is out.
  std::vector<morphbus::module_sensors_t> sensed_;
  std::vector<morphbus::body_pose_t> truth_;
};

}  // namespace morphbus::bridge
