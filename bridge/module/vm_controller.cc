#include "bridge/module/vm_controller.h"

#include <algorithm>
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include "bridge/lockstep/snapshot_bytes.h"
#include "bridge/module/read_held.h"
#include "bridge/wire/vm_codec.h"
#include "bridge/wire/wire_limits.h"
#include "vm/image/verifier.h"

namespace morphbus::bridge {
namespace {

/// Text of an image as a string of its own.
std::string ToString(const vm::Text& text) { return {text.data, text.size}; }

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

/// Adds bytes at the end.
void Append(std::vector<uint8_t>* out, const void* data, size_t size) {
  const auto* bytes = static_cast<const uint8_t*>(data);
  out->insert(out->end(), bytes, bytes + size);
}

/// What a saved controller begins with.
struct SavedHead {
  uint64_t state_size = sizeof(vm::VmState);
  uint64_t relay_size = 0;  ///< 0: as begun.
  // Of what is collected from outside.
  uint64_t collected_id = 0;
  uint64_t collected_size = 0;
  uint64_t collected_missing = 0;
};

/// Pieces from outside that a package of this size comes in.
size_t NumPieces(size_t size) { return (size + kMaxDeployPiece - 1) / kMaxDeployPiece; }

/// A package's program, and its head in *head. Null if the bytes are not the package of that id, or
/// if the verifier refuses the image.
std::unique_ptr<vm::VerifiedProgram> VerifyPackage(const uint8_t* bytes, uint32_t size, uint64_t id,
                                                   vm::PackageHead* head) {
  vm::Package package;
  if (!vm::ReadPackage(bytes, size, &package)) return nullptr;
  auto program = std::make_unique<vm::VerifiedProgram>();
  const vm::VerifyError error =
      vm::Verifier::Verify(package.image, package.image_size, program.get());
  if (error.message != nullptr || vm::PackageId(program->hash(), package) != id) {
    return nullptr;
  }
  *head = package;
  return program;
}

}  // namespace

VmController::VmController(const vm::VmConfig& config, const vm::VerifiedKinematics& kinematics,
                           const vm::VerifiedProgram& program)
    : config_(config),
      kinematics_(kinematics),
      first_program_(program),
      program_(&program),
      state_(std::make_unique<vm::VmState>()),
      vm_(std::make_unique<vm::Vm>(config, kinematics, program, state_.get())),
      relay_state_(std::make_unique<vm::RelayState>()),
      relay_(relay_state_.get()) {
  StartRelay();
}

VmController::~VmController() = default;

void VmController::StartRelay() {
  // In place, for the relay refers to it.
  new (relay_state_.get()) vm::RelayState();
  // The relay offers the first program to neighbours as the newest there is.
  relay_.Start(first_program_.bytes(), first_program_.size(), first_program_.hash());
}

void VmController::BeginAnew(uint32_t incarnation) {
  config_.incarnation = incarnation;
  program_ = &first_program_;
  vm_ = std::make_unique<vm::Vm>(config_, kinematics_, *program_, state_.get());
  replacement_.reset();
  StartRelay();
  next_.reset();
  collected_ = Collected();
}

bool VmController::RelayIsAsBegun() const {
  return program_ == &first_program_ && relay_.AsStarted();
}

void VmController::HoldIfReady() {
  // A newer one has taken the place of what was held, and of its bytes.
  if (!relay_.held()) next_.reset();
  if (!relay_.ready()) return;
  // Bytes from a neighbour are as untrusted as any: only the verifier makes a program of them.
  next_ = VerifyPackage(relay_.incoming_package(), relay_.incoming_size(), relay_.incoming_id(),
                        &next_head_);
  next_ == nullptr ? relay_.Refuse() : relay_.Hold();
}

void VmController::ReplaceIfDue(int64_t tick) {
  if (next_ == nullptr) return;
  int64_t root_tick = 0;
  if (vm_->RootTick(tick, &root_tick) && root_tick < next_head_.switch_tick) return;
  vm_->ReplaceProgram(*next_);
  program_ = next_.get();
  // The VM has let go of the old one.
  replacement_ = std::move(next_);
  relay_.Accept();
}

void VmController::Tick(const vm::TickInput& input, vm::TickOutput* output) {
  // The relay takes what the neighbours said of programs before the VM runs, and adds what we say
  // afterwards.
  relay_.Receive(input);
  HoldIfReady();
  ReplaceIfDue(input.tick);
  vm_->Tick(input, output);
  relay_.Fill(&output->message);
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
  vm::PackageHead head;
  const auto size = static_cast<uint32_t>(c.bytes.size());
  if (VerifyPackage(c.bytes.data(), size, id, &head) != nullptr) {
    relay_.Deploy(c.bytes.data(), size, id, head.number);
  }
  c.bytes.clear();
  c.have.clear();
}

std::vector<morphbus::status_t> VmController::Describe(const vm::StatusReport& report,
                                                       bool inspected) {
  HeldState held;
  if (inspected) held = ReadHeld(*program_, kinematics_, *state_);
  return ToStatus(report, NamesOf(report, kinematics_, *program_), config_.module_id,
                  config_.incarnation, kinematics_.num_joints(), inspected ? &held : nullptr);
}

void VmController::Save(std::vector<uint8_t>* out) {
  SavedHead head;
  head.relay_size = RelayIsAsBegun() ? 0 : sizeof(vm::RelayState);
  head.collected_id = collected_.id;
  head.collected_size = collected_.bytes.size();
  head.collected_missing = collected_.missing;
  Append(out, &head, sizeof head);
  // Most of the state is room for joints, tasks and messages that are not there.
  PutSparse(out, state_.get(), sizeof(vm::VmState));
  if (head.relay_size > 0) Append(out, relay_state_.get(), sizeof(vm::RelayState));
  Append(out, collected_.bytes.data(), collected_.bytes.size());
  Append(out, collected_.have.data(), collected_.have.size());
}

bool VmController::Load(const uint8_t* data, size_t size) {
  SnapshotReader in{data, size};
  const auto head = in.Get<SavedHead>();
  const bool relay = head.relay_size == sizeof(vm::RelayState);
  // Sizes tell builds apart; every one is checked before a byte is used.
  if (head.state_size != sizeof(vm::VmState) || (!relay && head.relay_size != 0) ||
      head.collected_size > vm::kMaxPackageBytes ||
      head.collected_missing > NumPieces(head.collected_size) ||
      (head.collected_missing == 0) != (head.collected_size == 0) ||
      // The VM's state is one flat struct, and so is the relay's.
      !in.GetSparse(state_.get(), sizeof(vm::VmState)) ||
      in.left != head.relay_size + head.collected_size + NumPieces(head.collected_size)) {
    return false;
  }
  // The program that ran when this was saved is in the relay; it is verified again, since a file is
  // as untrusted as a message.
  if (relay) {
    std::memcpy(static_cast<void*>(relay_state_.get()), in.Take(sizeof(vm::RelayState)),
                sizeof(vm::RelayState));
    auto program = std::make_unique<vm::VerifiedProgram>();
    if (vm::Verifier::Verify(relay_.running_image(), relay_.running_size(), program.get())
            .message != nullptr) {
      return false;
    }
    replacement_ = std::move(program);
    program_ = replacement_.get();
    // What waited for its tick waits on.
    if (relay_.held()) {
      next_ = VerifyPackage(relay_.incoming_package(), relay_.incoming_size(), relay_.incoming_id(),
                            &next_head_);
      if (next_ == nullptr) return false;
    }
  }
  // What has come of a program from outside is collected further.
  const uint8_t* bytes = in.Take(head.collected_size);
  const uint8_t* have = in.Take(NumPieces(head.collected_size));
  collected_ = {head.collected_id,
                {bytes, bytes + head.collected_size},
                {have, have + NumPieces(head.collected_size)},
                head.collected_missing};
  // A VM that resumes takes the state as it is.
  vm_ = std::make_unique<vm::Vm>(config_, kinematics_, *program_, state_.get(),
                                 vm::Vm::Start::kResume);
  return true;
}

}  // namespace morphbus::bridge
