#include "bridge/module/vm_controller.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "bridge/lockstep/snapshot_bytes.h"
#include "bridge/module/read_held.h"
#include "bridge/wire/status_codec.h"
#include "bridge/wire/wire_limits.h"
#include "vm/image/image_texts.h"

namespace morphbus::bridge {
namespace {

/// Looks up the names behind a report's numbers.
StatusNames NamesOf(const vm::StatusReport& report, const vm::VerifiedKinematics& kinematics,
                    const vm::VerifiedProgram& program) {
  // A task that runs no function has an empty name.
  const auto function = [&program](int f) {
    return f >= 0 && f < program.num_functions() ? ToString(program.function_name(f)) : "";
  };
  StatusNames names;
  names.type_name = ToString(kinematics.type_name());
  if (report.role >= 0) {
    const vm::RoleInfo role = program.role(report.role);
    names.role_name = ToString(role.name);
    for (int i = 0; i < report.num_labels && i < role.num_labels; ++i) {
      names.label_names.push_back(ToString(program.member_name(role.labels[i])));
      names.label_is_joint.push_back(program.function(role.labels[i]).return_type ==
                                     vm::ValueType::kJoint);
    }
  }
  for (int i = 0; i < report.num_tasks; ++i) {
    names.task_functions.push_back(function(report.tasks[i].function));
  }
  return names;
}

/// What a saved controller begins with.
struct SavedHead {
  uint64_t state_size = sizeof(vm::VmState);
  // 0: as begun.
  uint64_t relay_size = 0;
  std::array<uint64_t, 2> package_sizes = {};
  // Of what is collected from outside.
  uint64_t collected_id = 0;
  uint64_t collected_size = 0;
  uint64_t collected_missing = 0;
};

/// Pieces from outside that a package of this size comes in.
size_t NumPieces(size_t size) { return (size + kMaxDeployPiece - 1) / kMaxDeployPiece; }

}  // namespace

VmController::VmController(const vm::VmConfig& config, const vm::VerifiedKinematics& kinematics,
                           const vm::VerifiedProgram& program)
    : config_(config),
      kinematics_(kinematics),
      state_(std::make_unique<vm::VmState>()),
      vm_(std::make_unique<vm::Vm>(config, kinematics, program, state_.get())),
      programs_(program, &relay_state_, &packages_) {
  programs_.Begin();
}

VmController::~VmController() = default;

void VmController::ForgetPackages() {
  relay_state_ = vm::RelayState();
  packages_.Clear();
}

void VmController::BeginAnew(uint32_t incarnation) {
  config_.incarnation = incarnation;
  ForgetPackages();
  programs_.Begin();
  // The changer has gone back to the first program, with which the VM begins.
  vm_ = std::make_unique<vm::Vm>(config_, kinematics_, program(), state_.get());
  collected_ = Collected();
}

void VmController::Tick(const vm::TickInput& input, vm::TickOutput* output) {
  programs_.Tick(input, vm_.get(), output);
  if (change_) change_(input, output);
}

void VmController::TakePiece(const morphbus::deploy_piece_t& piece) {
  const auto id = static_cast<uint64_t>(piece.hash);
  const auto package_size = static_cast<size_t>(piece.image_size);
  const auto offset = static_cast<size_t>(piece.offset);
  if (offset >= package_size) return;
  // A piece of another package begins anew.
  Collected& c = collected_;
  if (id != c.id) {
    c = {id, std::vector<uint8_t>(package_size), std::vector<uint8_t>(NumPieces(package_size)),
         NumPieces(package_size)};
  }
  // In real time pieces get lost, and all of them come several times; each counts once. One that
  // does not lie on the grid of its package is damaged.
  const size_t index = offset / kMaxDeployPiece;
  const size_t expected = std::min(kMaxDeployPiece, package_size - offset);
  if (package_size != c.bytes.size() || offset % kMaxDeployPiece != 0 ||
      piece.bytes.size() != expected || c.have[index] != 0) {
    return;
  }
  std::copy(piece.bytes.begin(), piece.bytes.end(),
            c.bytes.begin() + static_cast<std::ptrdiff_t>(offset));
  c.have[index] = 1;
  if (--c.missing > 0) return;
  // Whole: only a program that the verifier accepts, and that is the one announced, is spread.
  const auto size = static_cast<uint32_t>(c.bytes.size());
  programs_.Deploy(c.bytes.data(), size, id);
  c.bytes.clear();
  c.have.clear();
}

std::vector<morphbus::status_t> VmController::Describe(const vm::StatusReport& report,
                                                       bool inspected) {
  HeldState held;
  if (inspected) held = ReadHeld(program(), kinematics_, *state_);
  return ToStatus(report, NamesOf(report, kinematics_, program()), config_.module_id,
                  config_.incarnation, kinematics_.num_joints(), inspected ? &held : nullptr);
}

void VmController::Save(std::vector<uint8_t>* out) {
  SavedHead head;
  // In most runs no program is on its way, and nothing of the relay need be saved.
  const bool relay = !programs_.AsBegun();
  if (relay) {
    head.relay_size = sizeof(vm::RelayState);
    for (const int place : {0, 1}) head.package_sizes[place] = programs_.relay().BytesIn(place);
  }
  head.collected_id = collected_.id;
  head.collected_size = collected_.bytes.size();
  head.collected_missing = collected_.missing;
  PutBytes(out, head);
  // Most of the state is room for joints, tasks and messages that are not there.
  PutSparse(out, state_.get(), sizeof(vm::VmState));
  if (relay) PutBytes(out, relay_state_);
  for (const int place : {0, 1}) PutRaw(out, packages_.Read(place), head.package_sizes[place]);
  PutRaw(out, collected_.bytes.data(), collected_.bytes.size());
  PutRaw(out, collected_.have.data(), collected_.have.size());
}

bool VmController::Load(const uint8_t* data, size_t size) {
  SnapshotReader in{data, size};
  const auto head = in.Get<SavedHead>();
  const bool relay = head.relay_size == sizeof(vm::RelayState);
  // Sizes tell builds apart; every one is checked before a byte is used.
  if (head.state_size != sizeof(vm::VmState) || (!relay && head.relay_size != 0) ||
      std::max({head.package_sizes[0], head.package_sizes[1], head.collected_size}) >
          vm::kMaxPackageBytes ||
      head.collected_missing > NumPieces(head.collected_size) ||
      (head.collected_missing == 0) != (head.collected_size == 0) ||
      // The VM's state is one flat struct, and so is the relay's.
      !in.GetSparse(state_.get(), sizeof(vm::VmState)) ||
      in.left != head.relay_size + head.package_sizes[0] + head.package_sizes[1] +
                     head.collected_size + NumPieces(head.collected_size)) {
    return false;
  }
  // Relay and packages are as untrusted as a message: the program that ran is verified again.
  ForgetPackages();
  if (relay) {
    std::memcpy(static_cast<void*>(&relay_state_), in.Take(sizeof(vm::RelayState)),
                sizeof(vm::RelayState));
  }
  for (const int place : {0, 1}) {
    const auto bytes = static_cast<uint32_t>(head.package_sizes[place]);
    if (bytes > 0) packages_.Write(place, 0, in.Take(bytes), bytes);
    if (relay && bytes != programs_.relay().BytesIn(place)) return false;
  }
  if (!relay) programs_.Begin();
  if (relay && !programs_.Resume()) return false;
  // What has come of a program from outside is collected further.
  const uint8_t* bytes = in.Take(head.collected_size);
  const uint8_t* have = in.Take(NumPieces(head.collected_size));
  collected_ = {head.collected_id,
                {bytes, bytes + head.collected_size},
                {have, have + NumPieces(head.collected_size)},
                head.collected_missing};
  // A VM that resumes takes the state as it is.
  vm_ = std::make_unique<vm::Vm>(config_, kinematics_, program(), state_.get(),
                                 vm::Vm::Start::kResume);
  return true;
}

}  // namespace morphbus::bridge
