#pragma once
// The simulator's side of the lockstep: publishes clock, sensors and true poses, takes commands. It
// also decides who may take part in the run, and says at the end how the run went.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/hello_t.hpp>
#include <morphbus/root_pose_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bridge/lockstep/lockstep_participant.h"
#include "bridge/lockstep/punctuality.h"
#include "bridge/lockstep/run_totals.h"
#include "bridge/lockstep/sim_lockstep.h"
#include "bridge/lockstep/simulated_robot.h"
#include "compiler/base/text_hash.h"
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
  /// What CLOCK says when the run has come to its last tick and nothing is wrong; empty:
  /// "finished". A run that is done again ends as the first one did.
  std::string end_reason = {};
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
  /// From the next tick on the run goes on without this module (by place in `modules`): it is asked
  /// to leave, its sensors and its mates' show no connection between them, and nobody waits for it.
  /// A control that the next CLOCK names must say so (LostModule in bridge/wire/channels.h).
  void Lose(size_t module) { Tell(&SimLockstep::Lose, static_cast<int>(module)); }
  /// Whether it was lost, or will be before the next tick.
  [[nodiscard]] bool lost(size_t module) const { return machine_.lost(static_cast<int>(module)); }
  /// Names of those that have left.
  [[nodiscard]] std::vector<std::string> GoneModules() const;
  /// Lockstep only: `at_barrier` is called, once, when all is there for the next tick, which waits
  /// for PassBarrier.
  void SetBarrier(std::function<void()> at_barrier) {
    at_barrier_ = std::move(at_barrier);
    machine_.SetBarrier();
  }
  void PassBarrier() { Tell(&SimLockstep::PassBarrier); }
  /// The number of a module's next incarnation, which begins now or with the next tick.
  uint32_t BeginIncarnation(size_t module) { return ++incarnations_[module]; }
  /// Called when a process has taken the place of a module that left nothing behind (by place in
  /// `modules`), with the first tick that it computes.
  void OnReplaced(std::function<void(size_t module, int64_t tick)> hook) {
    replaced_ = std::move(hook);
  }
  /// Text that the next CLOCK carries among its `controls`: an effect that begins at that tick.
  void AnnounceControl(const std::string& text);
  /// Gives a module (by place in `modules`) an invocation to issue, with the next tick that has
  /// room.
  void Invoke(size_t module, const vm::InvokeRequest& request);
  /// Asks a module (by place in `modules`) to say in STATUS of the next tick all that it holds.
  void Inspect(size_t module) { inspected_.insert(module); }
  /// Gives a module a package (vm/spread/package.h), from where it spreads: one piece a tick, from
  /// `from_tick` on. It is verified by the caller and at most vm::kMaxPackageBytes. In lockstep
  /// every piece arrives; in real time they are repeated until the module tells its neighbours that
  /// it has the package. A package that has not gone out whole by now is withdrawn: nobody runs it.
  void Deploy(size_t module, uint64_t id, const std::vector<uint8_t>& package, int64_t from_tick);
  /// Whether the package that was deployed last has gone out whole, so that it is run.
  [[nodiscard]] bool deployed_whole() const { return !deployment_ || deployment_->rounds > 0; }
  /// How many dockings the module furthest from this one (by place in `modules`) is away, by what
  /// the modules sensed last; modules that no row of dockings leads to do not count.
  [[nodiscard]] int HopsFrom(size_t module) const;
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
  [[nodiscard]] std::vector<morphbus::lateness_t> Lateness() const override;
  void CarryOut(const SimAction& action) override;
  // What the bus calls with messages of others. Each is decoded and checked before the machine
  // hears of it.
  void OnHello(const uint8_t* data, size_t size);
  void OnActuator(size_t module, const uint8_t* data, size_t size);
  void OnResend(const uint8_t* data, size_t size);
  void OnProgress(const uint8_t* data, size_t size);
  /// A process acknowledges END, or that it leaves.
  void OnTotals(const uint8_t* data, size_t size);
  /// In real time, while a module gets a package: does it have it?
  void OnTransform(uint64_t id, const uint8_t* data, size_t size);
  // (sim_participant_joins.cc)
  /// A process says HELLO under a later incarnation than the one that is known: it takes the place
  /// of a module that does not answer. Returns why it may not, empty if it may.
  std::string TakePlace(int process, const morphbus::hello_t& hello);
  /// Tells a process that was accepted under a later incarnation than the first where the run is.
  void Admit(int process);
  /// Takes out of the readings what connects modules with those that are lost.
  void HideLostModules();
  /// What everybody said of the run, compared with what was published; empty, or who
  /// disagrees. (sim_participant_checks.cc)
  [[nodiscard]] std::string Disagreement() const;
  /// The machine's number of a process of this run; -1 for others.
  int ProcessNumber(const std::string& name) const;
  /// Empty, or why the process does not fit the run, as a sentence. (sim_participant_checks.cc)
  std::string HelloError(int process, const morphbus::hello_t& hello) const;
  /// Senses the robot and publishes CLOCK, which says how many messages of the others follow.
  void BeginTick(int64_t tick);
  // The messages of a tick; PublishClock also publishes END.
  void PublishClock(int64_t tick, int8_t phase);
  void PublishSensors(int64_t tick);
  /// Adds as many requests and pieces of programs for the modules of a part of SENSORS as there is
  /// room for, and takes them off the queues.
  void AddOrders(size_t part, int64_t tick, morphbus::sensors_t* sensors);
  /// The next piece of the package that is given to a module of this part; `pieces` stays empty if
  /// there is none.
  void AddPiece(const std::vector<size_t>& members, int64_t tick,
                std::vector<morphbus::deploy_piece_t>* pieces);
  /// Adds the root's pose, as it is sensed, to the part of its module.
  void AddRootPose(size_t part, morphbus::sensors_t* sensors) const;
  void PublishWorld(int64_t tick);
  /// Sends those parts of the tick's SENSORS again that modules without an answer need.
  void RepeatSensors(int64_t tick);
  /// Applies the commands and moves the robot by a tick; in real time, notes who has not answered.
  void Advance(int64_t tick);
  /// Who kept silent too long, as a sentence; empty while all is well.
  [[nodiscard]] std::string SilentText() const;
  /// Works out how the run ended, as far as is known now.
  void Conclude();
  /// Tells the logger how the run ended.
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
  TextTable<int> numbers_;          ///< The other way round.
  std::vector<int64_t> claims_;     ///< By process; 0: none yet.
  /// By process: how often it has begun, and when it was heard last (wall time). By module: how
  /// many ACTUATOR and STATUS it has published.
  std::vector<uint32_t> incarnations_;
  std::vector<int64_t> heard_us_, num_actuators_, num_status_;
  /// A module's channels have messages that nobody vouches for any more but the logger.
  bool unvouched_ = false;
  std::vector<morphbus::actuator_t> commands_;      ///< By module, of the current tick.
  std::vector<std::vector<size_t>> sensors_parts_;  ///< Indices of modules, constant over the run.
  /// Messages on WORLD a tick, constant over the run.
  int world_parts_ = 0;
  /// What the processes said on TOTALS, by process.
  std::vector<TotalsParts> reports_;
  /// Of the numbers of each module's ACTUATOR.
  std::vector<SequenceTracker> received_;
  bool verdict_told_ = false;  ///< The logger was told how the run ended, and that holds.
  std::vector<std::string> turned_away_;
  /// The tick whose SENSORS were repeated last, and how often.
  int64_t repeated_tick_ = -1;
  int times_repeated_ = 0;
  /// Announcements that no CLOCK has carried yet.
  std::vector<std::string> controls_;
  /// A program on its way to the module from where it spreads.
  struct Deployment {
    /// Place in `modules` of the module that gets it.
    size_t module = 0;
    /// Of the package, by which its pieces are told from others'.
    uint64_t id = 0;
    std::vector<uint8_t> package;
    /// The first tick that takes a piece.
    int64_t from_tick = 0;
    /// Bytes that have gone out, and how often all of them have.
    size_t sent = 0;
    int rounds = 0;
    /// Real time: its module is listened to, and has it.
    bool watched = false, arrived = false;
  };
  /// The deployment is over: its module is listened to no more.
  void EndDeployment();

  // Invocations that wait for a tick that has room for them, oldest first, and the program that is
  // given to a module, if one is.
  std::deque<std::pair<size_t, vm::InvokeRequest>> requests_;
  std::set<size_t> inspected_;  ///< Modules that shall say what they hold.
  std::optional<Deployment> deployment_;
  // Called if set; see OnBeforeTick, OnAfterTick, SetBarrier, OnReplaced and OnMissing.
  std::function<void(int64_t)> before_tick_, after_tick_;
  std::function<void()> at_barrier_;
  std::function<void(size_t, int64_t)> replaced_;
  std::function<void(const std::vector<std::string>&)> report_missing_;
  int64_t report_missing_due_us_ = 0;
  /// Measures the root's pose, if it has a sensor for that; and what it said of the tick that is
  /// out.
  std::function<morphbus::root_pose_t()> sense_root_;
  morphbus::root_pose_t root_pose_ = {};
  /// Who answers late in real time.
  Punctuality punctuality_;
  // What the robot told of the tick that is out.
  std::vector<morphbus::module_sensors_t> sensed_;
  std::vector<morphbus::body_pose_t> truth_;
  std::vector<morphbus::contact_force_t> contacts_;
  // The last part of SENSORS that was sent, and the last ACTUATOR that came and was not kept.
  morphbus::sensors_t sensors_message_;
  morphbus::actuator_t command_;
};

}  // namespace morphbus::bridge
