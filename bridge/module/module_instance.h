#pragma once
// One module of a running robot, put together from images: the only way from an image to something
// that runs, whether in the module process, in an in-process run, or on a robot that stands still.
// From the inside out: the VM (vm/vm.h) in a VmController, which a ModuleParticipant drives on the
// bus, and a SnapshotFile if the process shall survive being killed.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bridge/lockstep/module/module_participant.h"
#include "bridge/module/module_images.h"
#include "bridge/module/snapshot_file.h"
#include "bridge/module/vm_controller.h"
#include "compiler/base/result.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/pose.h"

namespace morphbus::bridge {

/// What a module is told before it starts; all else comes from its sensors and neighbours.
struct ModuleSpec : ModuleIdentity {
  /// The link whose pose the root module broadcasts.
  struct Root {
    uint8_t link = 0;  ///< Number of the link in its type.
    vm::PoseF X_RL;    ///< That link's pose in the robot frame (m).
  };
  std::string kinematics;    ///< Name of its type's image in ModuleImages.
  std::optional<Root> root;  ///< Absent for all modules but the root.
};

/// A number that no other process claiming the same module will have.
int64_t RandomClaim();

/// A module with its virtual machine; on a bus once it has joined a run.
class ModuleInstance {
 public:
  /// `images` outlives the instance. Fails if the name cannot name a module, or if the image or the
  /// root's link does not exist.
  static Result<std::unique_ptr<ModuleInstance>> Create(const ModuleImages& images,
                                                        ModuleSpec spec);

  /// Makes the module a participant of its run, which then has to be started. Call once; `bus` and
  /// `time` outlive the instance.
  void Join(Bus* bus, const TimeSource* time);
  /// Saves the state to this file before every answer; with `resume`, goes on first from what the
  /// file holds (ModuleParticipant::ResumeFrom). Call after Join and before the participant starts.
  /// Fails if the file cannot be opened, or holds the state of another module, program or build.
  Result<void> SaveTo(const std::string& path, bool resume);

  /// The module's name in the model.
  [[nodiscard]] const std::string& name() const { return spec_.module; }
  /// The module's type.
  [[nodiscard]] const vm::VerifiedKinematics& type() const { return type_; }
  /// What computes its ticks.
  [[nodiscard]] VmController& controller() { return controller_; }
  /// After Join only.
  [[nodiscard]] ModuleParticipant& participant() { return *participant_; }
  [[nodiscard]] const ModuleParticipant& participant() const { return *participant_; }

 private:
  // Create has checked that the parts fit.
  ModuleInstance(const vm::VerifiedProgram& program, const vm::VerifiedKinematics& type,
                 ModuleSpec spec);

  /// What the module was told.
  ModuleSpec spec_;
  // The images, which outlive the instance.
  const vm::VerifiedProgram& program_;
  const vm::VerifiedKinematics& type_;
  // What computes the module's ticks, and what brings its answers onto the bus (null before Join).
  VmController controller_;
  // Null unless SaveTo was called.
  std::unique_ptr<SnapshotFile> snapshot_;
  std::unique_ptr<ModuleParticipant> participant_;
};

}  // namespace morphbus::bridge
