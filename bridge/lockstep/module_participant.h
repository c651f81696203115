#pragma once
// A module's side of the lockstep: waits for what a tick needs, lets the VM compute it, answers.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <morphbus/deploy_piece_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/lockstep/lockstep_participant.h"
#include "bridge/lockstep/module_lockstep.h"
#include "bridge/lockstep/name_directory.h"
#include "vm/module_api.h"

namespace morphbus::bridge {

/// What computes a module's ticks: the VM (bridge/module/vm_controller.h) or a test's fake. It
/// knows neither bus nor lockstep: whatever it needs stands in a tick's input.
class ModuleController {
 public:
  virtual ~ModuleController() = default;
  /// Computes one tick, and writes all of `*output`. Equal history of inputs gives equal output.
  virtual void Tick(const vm::TickInput& input, vm::TickOutput* output) = 0;
  /// A piece of a new program from outside, of the tick that is computed next; pieces come in
  /// order.
  virtual void TakePiece(const morphbus::deploy_piece_t& piece) = 0;
  /// The report, which is that of the last tick, as messages of at most kMaxPayloadBytes (several
  /// if not all fits into one). `inspected`: with all that the module holds.
  virtual std::vector<morphbus::status_t> Describe(const vm::StatusReport& report,
                                                   bool inspected) = 0;
  /// Appends the whole state that changes from tick to tick, so that a resumed process can go on
  /// from it.
  virtual void Save(std::vector<uint8_t>* out) = 0;
  /// Goes on from what Save wrote; false if it is not a state of this build, and then the
  /// controller must not be used any more.
  virtual bool Load(const uint8_t* data, size_t size) = 0;
};

/// Who a module is, and which run it takes part in.
struct ModuleIdentity : ModuleLockstep::Config {
  /// Name of the run, the first part of every channel.
  std::string run;
  /// Name and number of the module, as SENSORS tells them.
  std::string module;
  uint16_t module_id = 0;
  /// Counts the cold starts of the module, from 1.
  uint32_t incarnation = 1;
  uint64_t random_seed = 1;  ///< Of the program's random numbers (`run --random-seed`).
  int64_t claim = 1;         ///< Random number of the process, kept over a resume.
  int64_t restarts = 0;      ///< How often the process died and was started again.
  std::string build;         ///< Version of the software, for people.
  /// What the modules of this process have heard of names, which is the same for all; null: the
  /// module keeps that for itself.
  std::shared_ptr<NameDirectory> names;
};

/// What a module is told before it starts; all else it senses or hears.
struct ModuleParticipantOptions : ModuleIdentity {
  /// Its type, and how many joints, connectors and values of sensors that has: readings with others
  /// are refused.
  std::string type_name;
  int num_joints = 0;
  int num_connectors = 0;
  int num_sensor_values = 0;
  /// Messages that speak of another model are refused.
  uint64_t model_hash = 0;
  /// Hashes of the images it runs on, by which the sim knows whether it fits the run.
  uint64_t kinematics_hash = 0;
  uint64_t program_hash = 0;
};

/// STATUS goes out when something changed, and at every tick divisible by this.
inline constexpr int64_t kStatusEveryTicks = 50;

/// A module as a participant of a run: collects what a tick needs, lets the controller compute it,
/// publishes the answer.
class ModuleParticipant : public LockstepParticipant<ModuleLockstep> {
 public:
  /// `bus`, `controller` and `time` outlive the participant.
  ModuleParticipant(Bus* bus, ModuleController* controller, const TimeSource* time,
                    ModuleParticipantOptions options);

  /// `write` is called with every answer before it is published: a process that is killed at any
  /// moment and resumed from the last written bytes changes no payload.
  void OnBeforePublish(std::function<void(const std::vector<uint8_t>& snapshot)> write) {
    before_publish_ = std::move(write);
  }
  /// Goes on from a snapshot; call before Start(). A snapshot of an earlier incarnation than this
  /// one only tells which tick comes next and what was published: the controller begins anew, and
  /// the module's channels go on. Fails if the bytes are cut short or damaged, or of another
  /// module, program or build; then the participant must not be started.
  Result<void> ResumeFrom(const std::vector<uint8_t>& snapshot);

  /// Listens to the sim, and says HELLO unless it was resumed. A later incarnation than the first
  /// that was not resumed takes the place of one that left nothing behind: the sim tells it where
  /// the run is.
  void Start() override;
  /// Does what is due, and lets neighbours' messages wake the process while one is waited for.
  void OnTime() override;

  /// Empty if the run ended well for this module; else what went wrong, one sentence. Valid once
  /// done().
  [[nodiscard]] const std::string& error() const { return error_; }
  /// Why the run ended, as CLOCK tells; empty before.
  [[nodiscard]] const std::string& end_reason() const { return end_reason_; }
  /// The tick that is computed next.
  [[nodiscard]] int64_t tick() const { return machine_.tick(); }

 private:
  /// The last TRANSFORMs of a module that is or was mated, decoded.
  struct Mailbox {
    /// Name of that module, which its channel is called by.
    std::string name;
    /// Of the numbers on its channel.
    SequenceTracker tracker;
    /// The ticks that the messages below are of, -1 for none.
    std::array<int64_t, 2> ticks = {-1, -1};
    /// By parity of the tick: the machine needs the present tick's and the last one's only. They
    /// come last, since they are large and the rest is then close together in memory.
    std::array<vm::NeighbourMessage, 2> messages;
  };

  [[nodiscard]] Moment CurrentMoment() const override { return {machine_.tick(), sim_time_us_}; }
  void CarryOut(const ModuleAction& action) override;
  // What the bus calls with messages of others. Each is decoded and checked; then the machine hears
  // of it, and what it decides is carried out.
  void OnClock(const uint8_t* data, size_t size);
  void OnSensors(const uint8_t* data, size_t size);
  void OnTransform(uint16_t mate, const uint8_t* data, size_t size);
  void OnResend(const uint8_t* data, size_t size);
  /// The sim tells that the run is over, or that it goes on without a module.
  void OnLeave(const uint8_t* data, size_t size);
  /// The sim tells where the run is, to a module that takes another's place.
  void OnAdmit(const uint8_t* data, size_t size);
  /// Whether this is a part of SENSORS that another module of the process has looked through, and
  /// in which nothing is ours: then no more than that is taken from it.
  bool TakeKnownPart(const uint8_t* data, size_t size);
  /// Adds the names in a part of SENSORS to those that the process knows.
  void LearnNames(const uint8_t* data, size_t size);
  /// Whether SENSORS of this tick can be; if not, it is counted, and nothing of it is kept.
  bool SensorsFit(int64_t tick);
  /// Whether a reading is one of this module's, and as what it reads it.
  bool ReadingFits(const morphbus::module_sensors_t& mine, vm::TickInput* input) const;
  /// Takes our own reading, and what else the SENSORS that came last has for us, for the tick to
  /// compute, and tells whom it is mated to.
  void TakeReading(const vm::TickInput& input, std::vector<uint16_t>* mates);
  /// The modules mated to ours, each once, in order of connectors.
  void TakeMates(const vm::TickInput& input, std::vector<uint16_t>* mates);
  /// Takes this module's requests, pieces of a program, sensed pose and whether it is inspected out
  /// of the SENSORS that came last, for the coming tick.
  void TakeOrders();
  /// Listens to these neighbours, and from the own part of SENSORS on to nothing that is not
  /// needed. `own_part`: it is the one that came.
  void UpdateSubscriptions(const std::vector<uint16_t>& mates, bool own_part);
  /// Listens to a neighbour from now on.
  void Watch(uint16_t mate);
  /// Once every module's name is known: of SENSORS only this part, our own, is listened to.
  void NarrowSensors(int16_t part);
  /// Until the neighbours are known, keeps what any module says.
  void ListenToAllMates();
  /// Takes what a neighbour said before it was known as one.
  void TakeEarly(uint16_t mate);
  /// Stops listening to all modules but these.
  void ForgetAllBut(const std::vector<uint16_t>& mates);
  /// Computes a tick and publishes the answer.
  void Compute(int64_t tick);
  /// Publishes STATUS (if there is news), TRANSFORM and ACTUATOR of a tick, in this order.
  void Publish(int64_t tick);
  /// Saves everything that a resumed process needs to go on with `next_tick`.
  void WriteSnapshot(int64_t next_tick);
  /// What a neighbour said in a tick; null if that is not there. In real time its newest message
  /// stands in for it if it is at most three ticks older, and a deadline counts as missed.
  const vm::NeighbourMessage* MessageOf(uint16_t mate, int64_t tick);

  // The controller is not owned.
  ModuleController* controller_;
  ModuleParticipantOptions options_;
  Outbox::Sending channel_transform_, channel_actuator_, channel_status_;
  // Names of all modules by id, as SENSORS tells them, and mailboxes of the neighbours by id.
  std::shared_ptr<NameDirectory> directory_;
  std::map<uint16_t, Mailbox> mailboxes_;
  // What the controller is given for the tick to compute, and what it answered to the last one.
  vm::TickInput input_;
  /// Pieces of a new program that came with the sensors of the tick to compute.
  std::vector<morphbus::deploy_piece_t> pieces_;
  /// Whether STATUS of the tick to compute shall tell all that the module holds.
  bool inspected_ = false;
  /// What is decoded, computed and encoded for a moment: one for all modules of a process, so that
  /// a run of a thousand of them does not go through as many.
  struct Scratch;
  Scratch& scratch_;
  /// Sim time at which the tick to compute begins.
  int64_t sim_time_us_ = 0;
  /// Of the ticks of our part of SENSORS.
  SequenceTracker sensors_tracker_;
  // Where snapshots go (nowhere if empty), the last one, and the tick a resumed module goes on
  // with.
  std::function<void(const std::vector<uint8_t>&)> before_publish_;
  std::vector<uint8_t> snapshot_;
  int64_t resume_tick_ = 0;
  bool resumed_ = false;
  bool left_ = false;  ///< It was told that the run goes on without it.
  // What the bus has been told of our interest.
  bool narrowed_ = false, wakes_for_any_ = false, listens_to_all_ = false;
  /// TRANSFORM of whoever sent it before our neighbours were known, by channel.
  std::map<std::string, std::vector<uint8_t>> early_;
  std::string error_, end_reason_;
};

}  // namespace morphbus::bridge
