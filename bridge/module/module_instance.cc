#include "bridge/module/module_instance.h"

#include <sys/random.h>
#include <unistd.h>

#include <cstdio>
#include <utility>
#include <vector>

#include "bridge/lockstep/module/tick_inputs.h"
#include "bridge/wire/channels.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

/// What the VM needs to know of the spec.
vm::VmConfig ConfigOf(const ModuleSpec& spec) {
  vm::VmConfig config;
  config.module_id = spec.module_id;
  config.incarnation = spec.incarnation;
  config.random_seed = spec.random_seed;
  // In lockstep every neighbour's message is there, so none has to stand in for another.
  config.grace_ticks = spec.realtime ? kOldestUsefulTicks : 0;
  config.is_root = spec.root.has_value();
  if (spec.root) {
    config.root_link = spec.root->link;
    config.X_RL_root = spec.root->X_RL;
  }
  return config;
}

}  // namespace

int64_t RandomClaim() {
  int64_t claim = 0;
  if (getrandom(&claim, sizeof claim, 0) != sizeof claim) claim = 0;
  return claim == 0 ? 1 : claim;  // 0 means "none yet" to the sim.
}

Result<std::unique_ptr<ModuleInstance>> ModuleInstance::Create(const ModuleImages& images,
                                                               ModuleSpec spec) {
  // Everything is checked before anything is made: name, image, and the root's link.
  if (Result<void> named = CheckModuleName(spec.module); !named) return Fail(named.error().message);
  const vm::VerifiedKinematics* type = images.FindKinematics(spec.kinematics);
  if (type == nullptr) return Fail(spec.module + " has no kinematics image " + spec.kinematics);
  if (spec.root && spec.root->link >= type->num_links()) {
    return Fail(spec.module + " has " + std::to_string(type->num_links()) + " links, no link " +
                std::to_string(spec.root->link));
  }
  return std::unique_ptr<ModuleInstance>(
      new ModuleInstance(images.program(), *type, std::move(spec)));
}

ModuleInstance::ModuleInstance(const vm::VerifiedProgram& program,
                               const vm::VerifiedKinematics& type, ModuleSpec spec)
    : spec_(std::move(spec)),
      program_(program),
      type_(type),
      controller_(ConfigOf(spec_), type, program) {}

void ModuleInstance::Join(Bus* bus, const TimeSource* time) {
  ModuleParticipantOptions options;
  static_cast<ModuleIdentity&>(options) = spec_;
  // What its type and images are, by which the sim decides whether it fits.
  options.type_name = std::string(type_.type_name().data, type_.type_name().size);
  options.num_joints = type_.num_joints();
  options.num_connectors = type_.num_connectors();
  options.num_sensor_values = type_.num_sensor_values();
  options.model_hash = type_.model_hash();
  options.kinematics_hash = type_.hash();
  options.program_hash = program_.hash();
  participant_ = std::make_unique<ModuleParticipant>(bus, &controller_, time, options);
}

Result<void> ModuleInstance::SaveTo(const std::string& path, bool resume) {
  MORPHBUS_CHECK(participant_ != nullptr);
  Result<std::unique_ptr<SnapshotFile>> file = SnapshotFile::Open(path);
  if (!file) return Fail(file.error().message);
  snapshot_ = std::move(*file);
  // Killed before it had begun, there is nothing to go on from, and nothing was published.
  const std::vector<uint8_t> saved = resume ? snapshot_->Read() : std::vector<uint8_t>();
  // The participant checks that what was saved is its own.
  if (!saved.empty()) {
    if (Result<void> r = participant_->ResumeFrom(saved); !r) {
      return Fail(path + ": " + r.error().message);
    }
  }
  // From now on every answer is in the file before anybody hears it.
  participant_->OnBeforePublish([this, path](const std::vector<uint8_t>& bytes) {
    if (snapshot_ == nullptr) return;
    const Result<void> written = snapshot_->Write(bytes);
    if (written) return;
    // An older state would go on from a tick that is over, so there had better be none: should the
    // process die, its module begins anew.
    unlink(path.c_str());
    snapshot_.reset();
    std::fprintf(stderr, "morphbus-module: warning: %s saves its state no more: %s\n",
                 spec_.module.c_str(), written.error().message.c_str());
  });
  return {};
}

}  // namespace morphbus::bridge
