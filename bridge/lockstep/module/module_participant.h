#pragma once
// A module's side of the lockstep: waits for what a tick needs, lets the VM compute it, answers.

#include <cstdint>
#include <functional>
#include <memory>
#include <morphbus/sensors_t.hpp>
#include <string>
#include <vector>

#include "bridge/lockstep/lockstep_participant.h"
#include "bridge/lockstep/module/module_controller.h"
#include "bridge/lockstep/module/module_lockstep.h"
#include "bridge/lockstep/module/module_snapshot.h"
#include "bridge/lockstep/module/name_directory.h"
#include "bridge/lockstep/module/neighbour_mail.h"
#include "bridge/lockstep/module/tick_inputs.h"

namespace morphbus::bridge {

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
  using Taken = ModuleLockstep::Taken;

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
  /// The sim tells at which tick it is.
  void OnProgress(const uint8_t* data, size_t size);
  /// The sim tells where the run is, to a module that takes another's place.
  void OnAdmit(const uint8_t* data, size_t size);
  /// Takes a part of SENSORS that another module of the process has looked through, and in which
  /// nothing is ours: no more is taken from it than which one it is.
  void TakeKnownPart(const NameDirectory::Part& part);
  /// Listens to these neighbours, and from the own part of SENSORS on to nothing that is not
  /// needed. `own_part`: its number, if it is the one that came; else -1.
  void UpdateSubscriptions(const std::vector<uint16_t>& mates, int own_part);
  /// Computes a tick and publishes the answer.
  void Compute(int64_t tick);
  /// Publishes STATUS (if there is news), TRANSFORM and ACTUATOR of a tick, in this order.
  void Publish(int64_t tick);
  /// Saves everything that a resumed process needs to go on with `next_tick`.
  void Save(int64_t next_tick);
  /// What this process writes at the head of a snapshot.
  [[nodiscard]] SnapshotHead Head() const;
  /// What a neighbour said in a tick; null if that is not there. In real time its newest message
  /// stands in for it if it is at most three ticks older, and a deadline counts as missed.
  const vm::NeighbourMessage* MessageOf(uint16_t mate, int64_t tick);

  // The controller is not owned.
  ModuleController* controller_;
  ModuleParticipantOptions options_;
  std::string channel_transform_, channel_actuator_, channel_status_;
  /// Names of all modules by id, as SENSORS tells them.
  std::shared_ptr<NameDirectory> directory_;
  NeighbourMail mail_;
  TickInputs inputs_;
  /// What is decoded, computed and encoded for a moment: one for all modules of a process, so that
  /// a run of a thousand of them does not go through as many.
  struct Scratch;
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
  Farewell told_ = Farewell::kNone;  ///< What this module has acknowledged, or its predecessor.
  // What the bus has been told of our interest.
  bool narrowed_ = false, wakes_for_any_ = false;
  std::string error_, end_reason_;
};

}  // namespace morphbus::bridge
