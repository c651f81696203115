#pragma once
// A whole run on the in-process bus with a fake robot and fake programs, whose every output depends
// on every input: whatever goes wrong between the participants changes a hash.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridge/bus/faulty_bus.h"
#include "bridge/bus/inproc_bus.h"
#include "bridge/lockstep/late_messages.h"
#include "bridge/lockstep/log/log_participant.h"
#include "bridge/lockstep/module/module_participant.h"
#include "bridge/lockstep/sim/sim_participant.h"
#include "bridge/wire/sealed_bus.h"

namespace morphbus::bridge {

/// A chain of modules with two joints each; module i's connector 1 is mated to module i+1's
/// connector 0. The joints follow their commands at once, plus a drift that depends on all that was
/// commanded.
class FakeRobot : public SimulatedRobot {
 public:
  explicit FakeRobot(int num_modules);

  void Sense(std::vector<morphbus::module_sensors_t>* out) override;
  void Truth(std::vector<morphbus::body_pose_t>* out) override;
  void Actuate(const morphbus::actuator_t& command) override;
  void Advance() override { ++ticks; }

  /// Opens the connection between modules i and i+1 from the tick on.
  void DisconnectAt(int64_t tick, int i) { disconnect_tick_ = tick, disconnected_ = i; }

  int64_t ticks = 0;
  int64_t actuations = 0;

 private:
  std::vector<std::vector<double>> joints_;
  uint64_t mixed_ = 1;
  int64_t disconnect_tick_ = -1;
  int disconnected_ = -1;
};

/// Mixes sensors and the mates' messages into poses and commands; says something on STATUS now and
/// then, sometimes more than fits into one message.
class FakeController : public ModuleController {
 public:
  explicit FakeController(uint16_t id) : id_(id) {}

  void Tick(const vm::TickInput& input, vm::TickOutput* output) override;
  void TakePiece(const morphbus::deploy_piece_t& piece) override;
  std::vector<morphbus::status_t> Describe(const vm::StatusReport& report, bool inspected) override;
  void Save(std::vector<uint8_t>* out) override;
  bool Load(const uint8_t* data, size_t size) override;

  std::vector<int64_t> computed;  ///< Ticks, in order.
  int missing_messages = 0;       ///< Mates whose message was not there.
  int64_t requests = 0;
  std::vector<int64_t> inspected_at;  ///< Ticks of which it told what it holds.
  std::vector<uint8_t> deployed;

 private:
  uint16_t id_;
  uint64_t mixed_ = 7;
};

struct FakeRunOptions {
  std::string run = "test";
  int modules = 3;
  int64_t ticks = 40;
  double loss = 0;
  FaultPlan faults;  ///< Besides loss; without a seed of its own.
  uint64_t seed = 1;
  bool logger = true;
  bool realtime = false;
  double speed = 0;
  LockstepTiming timing;
  /// The run's; open runs have none.
  RunKey key = RunKey(RunKey::Bytes{1, 2, 3});
  /// Where each participant's bus comes from; empty: endpoints of the run's own hub, in virtual
  /// time. Else the clock is the machine's.
  std::function<std::unique_ptr<Bus>()> connect;
};

/// All participants of one run. Public members: tests look at and meddle with everything.
class FakeRun {
 public:
  explicit FakeRun(const FakeRunOptions& options);
  ~FakeRun();

  /// Until all are done; false if the run got stuck.
  bool Run();

  /// Starts all and runs until `done` says so or nothing can happen any more; then goes on with
  /// Run.
  bool RunUntil(const std::function<bool()>& done);

  [[nodiscard]] std::vector<Participant*> participants();
  /// Theirs, in the same order.
  [[nodiscard]] std::vector<const Ledger*> ledgers() const;

  struct Seat {
    /// On the run's hub and with its key, for a process that comes later.
    Seat(FakeRun* run, double loss, uint64_t seed)
        : Seat(run->hub.Connect(), run->options.key, WithLoss({}, loss, seed)) {}
    Seat(std::unique_ptr<Bus> connection, const RunKey& key, const FaultPlan& faults,
         std::function<int64_t()> now_us = {})
        : endpoint(std::move(connection)),
          sealed(endpoint.get(), key),
          bus(&sealed, faults, "", std::move(now_us)) {}
    std::unique_ptr<Bus> endpoint;
    SealedBus sealed;
    FaultyBus bus;
  };
  struct Module {
    std::unique_ptr<Seat> seat;
    std::unique_ptr<FakeController> controller;
    std::unique_ptr<ModuleParticipant> participant;
  };

  std::unique_ptr<Seat> MakeSeat(uint64_t seed);
  /// What is late at the seats that there are now.
  [[nodiscard]] LateMessages Late() const;
  ModuleParticipantOptions ModuleOptions(int i) const;
  SimParticipantOptions SimOptions() const;

  FakeRunOptions options;
  InprocHub hub;
  VirtualTime time;
  MonotonicTime wall;
  const TimeSource* clock = nullptr;
  FakeRobot robot;
  std::unique_ptr<Seat> sim_seat, log_seat;
  std::unique_ptr<SimParticipant> sim;
  std::vector<Module> modules;
  std::unique_ptr<LogParticipant> log;
  bool started = false;
  int64_t logged = 0, logged_duplicates = 0, logged_bad = 0, logged_refused = 0;
};

inline constexpr uint64_t kFakeModel = 0x1122334455667788;
inline constexpr uint64_t kFakeProgram = 0x99aabbccddeeff00;
inline constexpr uint64_t kFakeKinematics = 0x0123456789abcdef;

}  // namespace morphbus::bridge
