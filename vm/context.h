#pragma once
// What the parts of a VM share while they compute a tick.

#include <cstddef>
#include <cstdint>

#include "vm/kinematics_image.h"
#include "vm/module_api.h"
#include "vm/program.h"
#include "vm/state.h"

namespace morphbus::vm {

struct Context {
  const VmConfig& config;
  const VerifiedKinematics& kinematics;
  const VerifiedProgram& program;
  VmState& state;
  TickOutput* output = nullptr;  ///< nullptr outside Vm::Tick: faults and commands go nowhere.
};

/// The new messages of this tick, by own connector; nullptr where none came or it was of no use.
struct Mail {
  const NeighbourMessage* from[kMaxConnectors] = {};
};

/// Puts a fault on the status; beyond kMaxFaultsPerTick it is counted only.
inline void Report(Context& context, const Fault& fault) {
  if (context.output == nullptr) return;
  StatusReport& status = context.output->status;
  if (status.num_faults == kMaxFaultsPerTick) {
    ++status.faults_dropped;
    return;
  }
  status.faults[status.num_faults] = fault;
  if (fault.role < 0) status.faults[status.num_faults].role = context.state.role.role;
  ++status.num_faults;
}

inline void Report(Context& context, FaultCode code) {
  Fault fault;
  fault.code = code;
  Report(context, fault);
}

/// FNV-1a-64 over numbers: tells whether two states of affairs are alike.
class Digest {
 public:
  void Add(uint64_t value) {
    for (int i = 0; i < 8; ++i) {
      hash_ = (hash_ ^ (value & 0xff)) * 0x100000001b3ULL;
      value >>= 8;
    }
  }
  void Add(int64_t value) { Add(static_cast<uint64_t>(value)); }
  void Add(int value) { Add(static_cast<int64_t>(value)); }
  void Add(bool value) { Add(static_cast<uint64_t>(value ? 1 : 0)); }
  [[nodiscard]] uint64_t value() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325ULL;
};

}  // namespace morphbus::vm
