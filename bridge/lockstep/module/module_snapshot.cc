#include "bridge/lockstep/module/module_snapshot.h"

#include <cstring>

namespace morphbus::bridge {

void WriteSnapshot(SnapshotHead head, ModuleController* controller, const Outbox& outbox,
                   std::vector<uint8_t>* out) {
  out->resize(sizeof head);
  controller->Save(out);
  head.state_size = out->size() - sizeof head;
  std::memcpy(out->data(), &head, sizeof head);
  outbox.Save(out);
}

Result<SnapshotHead> ReadSnapshot(const std::vector<uint8_t>& snapshot,
                                  const SnapshotHead& expected, ModuleController* controller,
                                  Outbox* outbox) {
  SnapshotHead head;
  if (snapshot.size() < sizeof head) return Fail("the snapshot is cut short");
  std::memcpy(&head, snapshot.data(), sizeof head);
  // The head says whether the rest can be read at all.
  if (head.magic != expected.magic) return Fail("the snapshot is not one of this build");
  if (head.program_hash != expected.program_hash ||
      head.kinematics_hash != expected.kinematics_hash || head.module_id != expected.module_id) {
    return Fail("the snapshot is of another module, program or build");
  }
  if (head.state_size > snapshot.size() - sizeof head) return Fail("the snapshot is cut short");
  // The controller's state lies between head and outbox.
  const size_t state_end = sizeof head + head.state_size;
  const Result<size_t> used =
      outbox->Load(snapshot.data() + state_end, snapshot.size() - state_end);
  if (!used) return tl::unexpected<Error>(used.error());
  // Of a later incarnation what has been said stays so, but nothing else.
  const bool anew = expected.incarnation > head.incarnation;
  if (!anew && !controller->Load(snapshot.data() + sizeof head, head.state_size)) {
    return Fail("the snapshot is of another build");
  }
  return head;
}

}  // namespace morphbus::bridge
