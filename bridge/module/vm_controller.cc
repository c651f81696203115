#include "bridge/module/vm_controller.h"

#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

#include "bridge/wire/vm_codec.h"
#include "vm/image/verifier.h"

namespace morphbus::bridge {
namespace {

/// All of a RelayState but the images: where a change shows.
constexpr size_t kRelayHead = offsetof(vm::RelayState, images);

/// Text of an image as a string of its own.
std::string ToString(const vm::Text& text) { return {text.data, text.size}; }

/// Looks up the names behind a report's numbers.
StatusNames NamesOf(const vm::StatusReport& report, const vm::VerifiedKinematics& kinematics,
                    const vm::VerifiedProgram& program) {
  // A task that runs no function has an empty name.
  const auto function = [&program](int f) {
    return f >= 0 && f < program.num_functions() ? ToString(program.function(f).name) : "";
  };
  StatusNames names;
  names.type_name = ToString(kinematics.type_name());
  if (report.role >= 0) {
    const vm::RoleInfo& role = program.role(report.role);
    names.role_name = ToString(role.name);
    for (int i = 0; i < report.num_labels && i < role.num_labels; ++i) {
      names.label_names.push_back(ToString(role.labels[i].name));
      names.label_is_joint.push_back(role.labels[i].type == vm::ValueType::kJoint);
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
  uint64_t deploy_size = 0;
  uint64_t deploy_hash = 0;
};

}  // namespace

VmController::VmController(const vm::VmConfig& config, const vm::VerifiedKinematics& kinematics,
                           const vm::VerifiedProgram& program)
    : config_(config),
      kinematics_(kinematics),
      program_(&program),
      state_(std::make_unique<vm::VmState>()),
      vm_(std::make_unique<vm::Vm>(config, kinematics, program, state_.get())),
      relay_state_(std::make_unique<vm::RelayState>()),
      relay_(relay_state_.get()) {
  // The relay offers the first program to neighbours as the newest there is.
  relay_.Start(program.bytes(), program.size(), program.hash());
  Append(&pristine_, relay_state_.get(), kRelayHead);
}

VmController::~VmController() = default;

bool VmController::RelayIsPristine() const {
  return std::memcmp(pristine_.data(), relay_state_.get(), kRelayHead) == 0;
}

void VmController::ReplaceIfReady() {
  // Bytes from a neighbour are as untrusted as any: only the verifier makes a program of them.
  if (!relay_.ready()) return;
  auto next = std::make_unique<vm::VerifiedProgram>();
  const vm::VerifyError error =
      vm::Verifier::Verify(relay_.incoming_image(), relay_.incoming_size(), next.get());
  if (error.message != nullptr || next->hash() != relay_.incoming_hash()) return relay_.Refuse();
  vm_->ReplaceProgram(*next);
  program_ = next.get();
  // The VM has let go of the old one.
  replacement_ = std::move(next);
  relay_.Accept();
}

void VmController::Tick(const vm::TickInput& input, vm::TickOutput* output) {
  // The relay takes what the neighbours said of programs before the VM runs, and adds what we say
  // afterwards.
  relay_.Receive(input);
  ReplaceIfReady();
  vm_->Tick(input, output);
  relay_.Fill(&output->message);
}

void VmController::TakePiece(const morphbus::deploy_piece_t& piece) {
  const auto hash = static_cast<uint64_t>(piece.hash);
  // A first piece begins a new collection; one that does not continue it is dropped.
  if (piece.offset == 0) {
    deploy_.clear();
    deploy_hash_ = hash;
  }
  if (hash != deploy_hash_ || static_cast<size_t>(piece.offset) != deploy_.size()) return;
  deploy_.insert(deploy_.end(), piece.bytes.begin(), piece.bytes.end());
  if (deploy_.size() < static_cast<size_t>(piece.image_size)) return;
  // Whole: only a program that the verifier accepts, and that is the one announced, is spread.
  vm::VerifiedProgram checked;
  const auto size = static_cast<uint32_t>(deploy_.size());
  const vm::VerifyError error = vm::Verifier::Verify(deploy_.data(), size, &checked);
  if (error.message == nullptr && checked.hash() == hash) relay_.Deploy(deploy_.data(), size, hash);
  deploy_.clear();
}

std::vector<morphbus::status_t> VmController::Describe(const vm::StatusReport& report) {
  return ToStatus(report, NamesOf(report, kinematics_, *program_), config_.module_id,
                  config_.incarnation, kinematics_.num_joints());
}

void VmController::Save(std::vector<uint8_t>* out) {
  SavedHead head;
  head.relay_size = RelayIsPristine() ? 0 : sizeof(vm::RelayState);
  head.deploy_size = deploy_.size();
  head.deploy_hash = deploy_hash_;
  Append(out, &head, sizeof head);
  Append(out, state_.get(), sizeof(vm::VmState));
  if (head.relay_size > 0) Append(out, relay_state_.get(), sizeof(vm::RelayState));
  Append(out, deploy_.data(), deploy_.size());
}

bool VmController::Load(const uint8_t* data, size_t size) {
  SavedHead head;
  if (size < sizeof head) return false;
  std::memcpy(&head, data, sizeof head);
  const bool relay = head.relay_size == sizeof(vm::RelayState);
  // Sizes tell builds apart; every one is checked before a byte is used.
  if (head.state_size != sizeof(vm::VmState) || (!relay && head.relay_size != 0) ||
      head.deploy_size > vm::kMaxImageBytes ||
      size != sizeof head + head.state_size + head.relay_size + head.deploy_size) {
    return false;
  }
  data += sizeof head;
  // The VM's state is one flat struct, and so is the relay's.
  std::memcpy(static_cast<void*>(state_.get()), data, sizeof(vm::VmState));
  data += sizeof(vm::VmState);
  // The program that ran when this was saved is in the relay; it is verified again, since a file is
  // as untrusted as a message.
  if (relay) {
    std::memcpy(static_cast<void*>(relay_state_.get()), data, sizeof(vm::RelayState));
    data += sizeof(vm::RelayState);
    auto program = std::make_unique<vm::VerifiedProgram>();
    if (vm::Verifier::Verify(relay_.running_image(), relay_.running_size(), program.get())
            .message != nullptr) {
      return false;
    }
    replacement_ = std::move(program);
    program_ = replacement_.get();
  }
  // What has come of a program from outside is collected further.
  deploy_.assign(data, data + head.deploy_size);
  deploy_hash_ = head.deploy_hash;
  // A VM that resumes takes the state as it is.
  vm_ = std::make_unique<vm::Vm>(config_, kinematics_, *program_, state_.get(),
                                 vm::Vm::Start::kResume);
  return true;
}

}  // namespace morphbus::bridge
