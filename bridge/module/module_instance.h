#pragma once
// One module of a running robot, put together from images: the only way from an image to something
// that runs, whether in the module process, in an in-process run, or on a robot that stands still.
// From the inside out: the VM (vm/vm.h) in a VmController, which a ModuleParticipant drives on the
// bus, and a SnapshotFile if the process shall survive being killed.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/lockstep/module_participant.h"
#include "bridge/module/snapshot_file.h"
#include "bridge/module/vm_controller.h"
#include "compiler/base/result.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/pose.h"
#include "vm/image/program.h"

namespace morphbus::bridge {

/// The program image and the module types' kinematics images of one process, verified, each once.
/// Stays where it is: instances point into it.
class ModuleImages {
 public:
  ModuleImages() = default;
  ModuleImages(const ModuleImages&) = delete;
  ModuleImages& operator=(const ModuleImages&) = delete;

  /// Verifies the program image and keeps it, in place of an earlier one. `name` is what an error
  /// calls it; the error also says which byte of the image is wrong, and why.
  Result<void> AddProgram(const std::string& name, std::vector<uint8_t> bytes);
  /// Verifies a kinematics image and keeps it under `name`, which is also what an error calls it.
  Result<void> AddKinematics(const std::string& name, std::vector<uint8_t> bytes);

  /// The program of all modules of the process. Valid once AddProgram has succeeded.
  [[nodiscard]] const vm::VerifiedProgram& program() const { return program_; }
  /// Null if none was added under this name.
  [[nodiscard]] const vm::VerifiedKinematics* FindKinematics(const std::string& name) const;

 private:
  /// An image and what the verifier made of it, which points into the bytes.
  struct Kinematics {
    std::vector<uint8_t> bytes;
    vm::VerifiedKinematics verified;
  };
  // What is verified points into the bytes, so neither may move.
  std::vector<uint8_t> program_bytes_;
  vm::VerifiedProgram program_;
  std::map<std::string, Kinematics> kinematics_;
};

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
