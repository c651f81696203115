#pragma once
// What the parts of a VM share while they compute a tick.
// The tick itself is in vm/vm.cc; each part below vm/run, vm/role, vm/space and vm/spread does its
// share of it on one Context.

#include <cstddef>
#include <cstdint>

#include "vm/image/kinematics_image.h"
#include "vm/image/program.h"
#include "vm/module_api.h"
#include "vm/run/state.h"

namespace morphbus::vm {

class StepObserver;

/// What the parts of a VM work on in one tick: what stays the same, what changes, and where to put
/// what they have to say. It refers to what the Vm owns.
struct Context {
  /// The host's settings, which stay the same while the VM lives.
  const VmConfig& config;
  /// The module's own body and the program that it runs.
  const VerifiedKinematics& kinematics;
  const VerifiedProgram& program;
  /// Everything that changes from tick to tick.
  VmState& state;
  /// Where status and commands go; nullptr outside Vm::Tick, where faults and commands go nowhere.
  TickOutput* output = nullptr;
  /// What looks on while tasks run; nullptr: nothing does.
  StepObserver* observer = nullptr;
  /// What the module senses and hears; nullptr outside Vm::Tick.
  const TickInput* input = nullptr;
};

/// What this tick brought from the neighbours.
struct Inbox {
  /// The new messages, by own connector; nullptr where none came or it was of no use.
  const NeighbourMessage* from[kMaxConnectors] = {};
  /// Mask of the connectors whose neighbour is another one than before, or has started anew.
  uint32_t changed = 0;
};

/// Puts a fault on the status; beyond kMaxFaultsPerTick it is counted only. Unless the fault names
/// a role, it gets the role that the module holds.
inline void Report(Context& context, const Fault& fault) {
  // Outside of a tick there is no status to be put on.
  if (context.output == nullptr) return;
  StatusReport& status = context.output->status;
  // The status has room for a few faults; the others are counted, so that none is lost unseen.
  if (status.num_faults == kMaxFaultsPerTick) {
    ++status.faults_dropped;
    return;
  }
  status.faults[status.num_faults] = fault;
  if (fault.role < 0) status.faults[status.num_faults].role = context.state.role.role;
  ++status.num_faults;
}

/// Sets the source position of a fault to an instruction, for the people who wrote the program.
/// `pc` is its byte offset in the function.
inline void SetPlace(const VerifiedProgram& program, int function, uint32_t pc, Fault* fault) {
  fault->function = static_cast<int16_t>(function);
  fault->pc = static_cast<uint16_t>(pc);
  fault->line = static_cast<uint16_t>(program.LineOf(function, pc));
}

/// Notes in a fault that it ends a task.
inline void SetEnded(const Task& task, Fault* fault) {
  fault->ended_task = static_cast<int8_t>(task.kind);
  fault->task_function = static_cast<int16_t>(task.stack.frames[0].function);
}

/// The fault with which a run of a function ended, at the instruction where it did. The role is
/// left open; Report fills it in.
inline Fault FaultOf(const VerifiedProgram& program, const RunResult& result) {
  Fault fault;
  fault.code = result.fault;
  fault.keyword = result.keyword;
  // An unresolved label tells how many joints or links fit it.
  fault.measured = static_cast<float>(result.num_found);
  // So does an array that has no such element; how many it has stands in the instruction.
  if (result.fault == FaultCode::kNoElement) {
    const uint32_t at = program.function(result.function).code_begin + result.pc;
    fault.limit = program.bytes()[at + 2];
  }
  SetPlace(program, result.function, result.pc, &fault);
  return fault;
}

/// True if what was said under the program of this hash means the same under the one that runs: it
/// is that one, or one before it if only parameters have changed since. Neighbours' messages of the
/// tick before, and invocations on their way, are then as good as new ones.
inline bool MeansTheSame(const Context& context, uint64_t program_hash) {
  if (program_hash == context.program.hash()) return true;
  for (const uint64_t former : context.state.former_values.hashes) {
    if (former != 0 && former == program_hash) return true;
  }
  return false;
}

/// A hash over numbers, by which two states of affairs are compared without keeping the earlier
/// one. Each number counts as 64 bits, so that all hosts agree.
class Digest {
 public:
  /// Adds numbers and flags. They are widened to 64 bits, so that the type in which a number is
  /// kept does not matter.
  template <class... Numbers>
  void Add(Numbers... numbers) {
    (Mix(static_cast<uint64_t>(static_cast<int64_t>(numbers))), ...);
  }
  /// The digest of all that was added so far; equal digests are taken for equal states.
  [[nodiscard]] uint64_t value() const { return hash_; }

 private:
  /// Each number is mixed in by an exclusive or and a product with an odd constant, as FNV does
  /// with each byte; the shift lets the high half act on the low one. The constant is that of
  /// Fibonacci hashing, 2^64 over the golden ratio (Knuth, The Art of Computer Programming 3,
  /// Sec. 6.4).
  void Mix(uint64_t value) {
    hash_ = (hash_ ^ value) * 0x9e3779b97f4a7c15ULL;
    hash_ ^= hash_ >> 32;
  }

  /// The hash so far; it begins with the offset basis of FNV.
  uint64_t hash_ = 0xcbf29ce484222325ULL;
};

}  // namespace morphbus::vm
