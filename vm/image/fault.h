#pragma once
// What a VM reports when something in a running program goes wrong: codes and numbers only. Names
// and sentences are made from them where a person reads them (vm/image/fault_text.h).

#include <cstdint>

#include "vm/image/pose.h"
#include "vm/image/values.h"

namespace morphbus::vm {

/// The kinds of fault; vm/image/faults.def says what each means.
enum class FaultCode : uint8_t {
#define FAULT(name, short_text, sentence) name,
#include "vm/image/faults.def"
#undef FAULT
};

/// How many kinds there are; a code from a newer version may be larger.
inline constexpr int kNumFaultCodes = 0
#define FAULT(name, short_text, sentence) +1
#include "vm/image/faults.def"
#undef FAULT
    ;

/// What happened in a few words, for every fault of that code, e.g. "division by zero"; also for
/// codes of a newer version.
const char* FaultName(FaultCode code);

/// By which of a role's routines a task was begun.
enum class TaskKind : uint8_t { kStartup, kBehavior, kCommand, kHandler };

/// One fault. Indices are those of the module type's and the program's tables; -1 means that the
/// fault does not concern such a thing. Angles are in degrees and speeds in degrees a second
/// (millimetres for prismatic joints), in the sign in which the program asked, as programs speak.
struct Fault {
  FaultCode code = FaultCode::kNone;
  /// The role held, or the one concerned.
  int16_t role = -1;
  /// The other role that fits, for kAmbiguousRole.
  int16_t rival_role = -1;
  /// The function in which it happened; for an invocation, the command's.
  int16_t function = -1;
  /// The byte offset of the call or requirement in that function.
  uint16_t pc = 0;
  /// Its source line, or that of the role; 0 without one, and where the module holds no notes
  /// (FillLines in vm/image/fault_text.h).
  uint16_t line = 0;
  /// The keyword concerned.
  int16_t keyword = -1;
  /// The part of the module concerned.
  int8_t joint = -1, link = -1, connector = -1;
  /// What the program asked for.
  float asked = 0;
  /// What was found instead.
  float measured = 0;
  /// The bound or capacity that was met.
  float limit = 0;
  /// The axis given to setJointAxis, for kAxisNotAligned.
  Axis asked_axis = Axis::kAny;
  /// The TaskKind of the task that the fault has ended; -1 if it has ended none.
  int8_t ended_task = -1;
  /// The function with which that task began, in which it need not have stood.
  int16_t task_function = -1;
  /// kAxisNotAligned: the direction about which the link turns counter-clockwise for positive
  /// actuator values, in the robot frame (unit vector).
  Vec3 direction_R = {};
};

}  // namespace morphbus::vm
