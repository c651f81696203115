#pragma once
// What a module's process saves before it publishes an answer, so that another process can go on.

#include <cstdint>
#include <vector>

#include "bridge/lockstep/module/module_controller.h"
#include "bridge/lockstep/outbox.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// What a module has been told of its end, and acknowledges. A process that goes on in its place
/// must know it, since the simulator does not say it again once it has been acknowledged.
enum class Farewell : uint16_t {
  kNone = 0,
  kLeave = 1,  ///< The run goes on without it.
  kEnd = 2,    ///< The run is over.
};

/// The first bytes of a snapshot. They say whose state follows, so that another module's or build's
/// is refused.
struct SnapshotHead {
  uint64_t magic = 0x4d42534e41503033;  ///< "MBSNAP03"
  int64_t next_tick = 0;                ///< The tick that is computed next.
  int64_t claim = 0;                    ///< Of the process, which the next one keeps.
  /// Of the images that the module runs on.
  uint64_t program_hash = 0;
  uint64_t kinematics_hash = 0;
  uint64_t state_size = 0;   ///< Bytes of the controller's state; filled in by WriteSnapshot.
  uint32_t incarnation = 0;  ///< Which of the module's cold starts saved this.
  uint16_t module_id = 0;
  Farewell told = Farewell::kNone;  ///< What the module knew of its end.
};

/// Writes a snapshot: the head, the state of the controller, and everything that was sent and is
/// still kept. Replaces the content of `out`.
void WriteSnapshot(SnapshotHead head, ModuleController* controller, const Outbox& outbox,
                   std::vector<uint8_t>* out);

/// Has controller and outbox go on from a snapshot, and returns its head. The controller of a later
/// incarnation than the snapshot's stays as it is: it knows nothing of what an earlier one knew.
/// Fails if the bytes are cut short or damaged, or of another module, program or build; then
/// neither must be used any more.
/// @param expected  what the head must say of module, program and kinematics, and the incarnation
///                  that reads it.
Result<SnapshotHead> ReadSnapshot(const std::vector<uint8_t>& snapshot,
                                  const SnapshotHead& expected, ModuleController* controller,
                                  Outbox* outbox);

}  // namespace morphbus::bridge
