#pragma once
// A module's side of the lockstep: waits for what a tick needs, lets the VM compute it, answers.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <morphbus/deploy_piece_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <string>
#include <vector>

#include "bridge/module_lockstep.h"
#include "bridge/outbox.h"
#include "bridge/party.h"
#include "bridge/sequence_tracker.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// What computes a module's ticks: the VM (bridge/vm_brain.h) or a test's fake.
class ModuleBrain {
 public:
  virtual ~ModuleBrain() = default;
  /// Computes one tick. Equal history of inputs gives equal output.
  virtual void Tick(const vm::TickInput& input, vm::TickOutput* output) = 0;
  /// A piece of a new program from outside, of the tick that is computed next; pieces come in
  /// order.
  virtual void TakePiece(const morphbus::deploy_piece_t& piece) = 0;
  /// The report as messages of at most kMaxPayloadBytes (several if the faults do not fit into
  /// one).
  virtual std::vector<morphbus::status_t> Describe(const vm::StatusReport& report) = 0;
  /// Appends the whole changing state, for resuming, and goes on from it (false: not its state).
  virtual void Save(std::vector<uint8_t>* out) = 0;
  virtual bool Load(const uint8_t* data, size_t size) = 0;
};

struct ModulePartyOptions {
  std::string run;
  std::string module;
  uint16_t module_id = 0;
  uint32_t incarnation = 1;
  std::string type_name;
  int num_joints = 0;
  int num_connectors = 0;
  uint64_t model_hash = 0;
  uint64_t kinematics_hash = 0;
  uint64_t program_hash = 0;
  int64_t claim = 1;  ///< Random number of the process, kept over a resume.
  bool realtime = false;
  std::string build;  ///< Version of the software, for people.
  LockstepTiming timing;
};

/// STATUS goes out when something changed, and at every tick divisible by this.
inline constexpr int64_t kStatusEveryTicks = 50;

class ModuleParty : public Party {
 public:
  /// `bus`, `brain` and `time` outlive the party.
  ModuleParty(Bus* bus, ModuleBrain* brain, const TimeSource* time, ModulePartyOptions options);

  /// `write` is called with every answer before it is published: a process that is killed at any
  /// moment and resumed from the last written bytes changes no payload.
  void OnBeforePublish(std::function<void(const std::vector<uint8_t>& snapshot)> write);
  /// Goes on from a snapshot; call before Start().
  Result<void> ResumeFrom(const std::vector<uint8_t>& snapshot);

  void Start() override;
  void OnTime() override;
  [[nodiscard]] int64_t next_deadline_us() const override;
  [[nodiscard]] bool done() const override;
  [[nodiscard]] const Ledger& ledger() const override { return ledger_; }
  /// Sends HEALTH with the ledger.
  void PublishHealth();

  /// Empty if the run ended well.
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& end_reason() const { return end_reason_; }
  [[nodiscard]] int64_t tick() const { return machine_.tick(); }

 private:
  /// The last messages of a module that is or was mated.
  struct Mailbox {
    std::string name;
    std::array<vm::NeighbourMessage, 2> messages;  ///< Lockstep: by parity of the tick.
    std::array<int64_t, 2> ticks = {-1, -1};
  };

  void OnClock(const uint8_t* data, size_t size);
  void OnSensors(const uint8_t* data, size_t size);
  void OnTransform(uint16_t mate, const uint8_t* data, size_t size);
  void OnAsk(const uint8_t* data, size_t size);
  void TakeMates(const vm::TickInput& input, std::vector<uint16_t>* mates);
  void TakeOrders();
  void Watch(uint16_t mate);
  void ForgetAllBut(const std::vector<uint16_t>& mates);
  /// Carries out the machine's wishes until it has none.
  void Settle();
  void Do(const ModuleAction& action);
  void Compute(int64_t tick);
  void Publish(int64_t tick);
  void WriteSnapshot(int64_t next_tick);
  void SayHello();
  void AcknowledgeEnd();
  void AskMate(uint16_t mate, int64_t tick);
  const vm::NeighbourMessage* MessageOf(uint16_t mate, int64_t tick);
  void Bad() { ++ledger_.bad; }

  const TimeSource* time_;
  ModuleBrain* brain_;
  ModulePartyOptions options_;
  Bus* bus_;
  Ledger ledger_;
  Outbox outbox_;
  ModuleLockstep machine_;
  SequenceTrackers trackers_;
  std::string channel_transform_, channel_actuator_, channel_status_;
  std::map<uint16_t, std::string> directory_;  ///< Names by id, from SENSORS.
  std::map<uint16_t, Mailbox> mailboxes_;
  vm::TickInput input_;
  std::vector<morphbus::deploy_piece_t> pieces_;  ///< For the tick to compute.
  vm::TickOutput output_;
  morphbus::sensors_t sensors_;      ///< Reused.
  morphbus::transform_t transform_;  ///< Reused.
  int64_t sim_time_us_ = 0;
  std::function<void(const std::vector<uint8_t>&)> before_publish_;
  std::vector<uint8_t> snapshot_;
  int64_t resume_tick_ = 0;
  std::vector<ModuleAction> actions_;
  bool working_ = false;  ///< Within Settle().
  std::string error_, end_reason_;
};

}  // namespace morphbus::bridge
