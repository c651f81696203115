#pragma once
// The simulator's side of the lockstep: beats the clock, publishes sensors and truth, takes
// commands.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/ask_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <vector>

#include "bridge/outbox.h"
#include "bridge/party.h"
#include "bridge/sequence_tracker.h"
#include "bridge/sim_lockstep.h"
#include "bridge/simulated_robot.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// A module that must join before tick 0 is over.
struct ExpectedModule {
  std::string name;
  uint16_t id = 0;
  std::string type_name;
  uint64_t kinematics_hash = 0;
  int num_connectors = vm::kMaxNeighbours;  ///< Of its type; fewer make smaller SENSORS.
};

struct SimPartyOptions {
  std::string run;
  uint64_t model_hash = 0;
  uint64_t program_hash = 0;            ///< Of the image every module must run; 0: any.
  std::vector<ExpectedModule> modules;  ///< In order of id.
  bool logger = false;                  ///< A logger is a party of the run.
  int64_t num_ticks = -1;               ///< Ends after so many; -1: when stopped.
  int32_t tick_us = 20000;
  bool realtime = false;
  double speed = 0;  ///< Times real time; 0: as fast as possible. Real time: 1.
  LockstepTiming timing;
};

/// How a run ended, for the summary.
struct SimOutcome {
  bool ok = false;
  std::string error;   ///< Empty if ok; names the process concerned.
  std::string reason;  ///< As in CLOCK's end_reason.
  int64_t ticks = 0;
  std::string run_hash;       ///< 32 hexadecimal digits, once every module acknowledged END.
  std::string recorded_hash;  ///< The logger's; empty without one.
  std::vector<ChannelTotal> totals;
  int64_t messages = 0;  ///< Distinct messages on hashed channels.
  int64_t missed_deadlines = 0;
};

class SimParty : public Party {
 public:
  /// `bus`, `robot` and `time` outlive the party.
  SimParty(Bus* bus, SimulatedRobot* robot, const TimeSource* time, SimPartyOptions options);
  ~SimParty() override;

  void Start() override;
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override;
  [[nodiscard]] bool done() const override;
  [[nodiscard]] const Ledger& ledger() const override { return ledger_; }
  /// Sends HEALTH with the ledger.
  void PublishHealth();

  /// Ends the run after the current tick; `reason` goes into CLOCK.
  void RequestStop(const std::string& reason);
  void Pause();
  void Resume();
  /// Paused: runs one tick more.
  void Step();
  /// Times real time; 0: as fast as possible.
  void SetSpeed(double speed);
  /// Text that the next CLOCK carries among its `controls`: an effect that begins at that tick.
  void AnnounceControl(const std::string& text);
  /// Gives a module (by place in `modules`) an invocation to issue, with the next tick that has
  /// room.
  void Invoke(size_t module, const vm::InvokeRequest& request);
  /// Gives a module a new program, from where it spreads: one piece a tick. `image` is verified by
  /// the caller and at most vm::kMaxImageBytes; a deployment under way is finished first.
  void Deploy(size_t module, uint64_t hash, const std::vector<uint8_t>& image);
  /// Called before sensors of a tick are published (tick number): apply controls to the robot here.
  void OnBeforeTick(std::function<void(int64_t tick)> hook);

  [[nodiscard]] int64_t tick() const { return machine_.tick(); }
  [[nodiscard]] bool paused() const { return machine_.paused(); }
  [[nodiscard]] const SimOutcome& outcome() const { return outcome_; }
  /// Processes that have not said HELLO yet, for progress messages.
  [[nodiscard]] std::vector<std::string> missing_processes() const;
  /// Processes that were turned away without harm to the run, one sentence each (at most 16 are
  /// kept).
  [[nodiscard]] const std::vector<std::string>& turned_away() const { return turned_away_; }

 private:
  void OnHello(const uint8_t* data, size_t size);
  void OnActuator(size_t module, const uint8_t* data, size_t size);
  void OnAsk(const uint8_t* data, size_t size);
  void TakeEndAck(int process, const morphbus::ask_t& ask);
  int ProcessNumber(const std::string& name) const;
  std::string WhyUnfit(int process, const morphbus::hello_t& hello) const;
  /// Carries out the machine's wishes until it has none.
  void Settle();
  void Do(const SimAction& action);
  void PublishTick(int64_t tick);
  void PublishClock(int64_t tick, int8_t phase);
  void PublishSensors(int64_t tick);
  void AddOrders(size_t part, morphbus::sensors_t* sensors);
  void PublishWorld(int64_t tick);
  void Repeat(const std::string& channel, int64_t tick, int parts);
  void Advance();
  void Ask(const std::string& to, int8_t kind, const std::string& channel, int64_t sequence);
  void Finish();
  /// Ends the run at once, with an error.
  void Refuse(const std::string& why);
  /// Empty, or why these sensors cannot be told to anybody.
  std::string WhyUnusable() const;

  const TimeSource* time_;
  SimulatedRobot* robot_;
  SimPartyOptions options_;
  Bus* bus_;
  Ledger ledger_;
  Outbox outbox_;
  SimLockstep machine_;
  SequenceTrackers trackers_;
  SimOutcome outcome_;
  std::string channel_clock_, channel_sensors_, channel_world_;
  std::vector<std::string> names_;  ///< Machine's process index -> name; the logger last.
  std::vector<int64_t> claims_;     ///< By process; 0: none yet.
  std::vector<morphbus::actuator_t> commands_;      ///< By module, of the current tick.
  std::vector<std::vector<size_t>> sensors_parts_;  ///< Indices of modules, constant over the run.
  int world_parts_ = 0;
  std::map<std::string, ChannelTotal> module_totals_;
  std::vector<std::string> turned_away_;
  std::vector<std::string> controls_;
  struct Deployment {
    size_t module = 0;
    uint64_t hash = 0;
    std::vector<uint8_t> image;
    size_t sent = 0;
  };
  std::deque<std::pair<size_t, vm::InvokeRequest>> requests_;
  std::deque<Deployment> deployments_;
  std::function<void(int64_t)> before_tick_;
  std::vector<SimAction> actions_;
  bool working_ = false;  ///< Within Settle().
  std::vector<morphbus::module_sensors_t> sensed_;
  std::vector<morphbus::body_pose_t> truth_;
};

}  // namespace morphbus::bridge
