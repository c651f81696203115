#pragma once
// Every fixed capacity of the VM. Overflow of any of them is a fault, never silent. The VM uses no
// heap, so its state and its messages are as large as these say (vm/run/state.h). The compiler and
// the verifier refuse programs and module types that exceed them.
//
// There are two profiles. The large one is that of the host. The small one (MORPHBUS_VM_SMALL) is
// for microcontrollers: it is enough for the quadruped, and gives the same outputs as the large one
// as long as nothing overflows. docs/footprint.md says how much memory each needs. A firmware for
// another robot raises what it needs in its own copy of the small column.

#include <cstdint>

namespace morphbus::vm {

#ifdef MORPHBUS_VM_SMALL
inline constexpr bool kSmallProfile = true;
#else
inline constexpr bool kSmallProfile = false;
#endif

/// The capacity of the profile that is compiled.
template <class T>
constexpr T Capacity(T large, T small) {
  return kSmallProfile ? small : large;
}

/// True if the instructions that the quadruped needs none of are there (vm/image/opcodes.def, the
/// last ones), which the small profile has with MORPHBUS_VM_ALL_INSTRUCTIONS only. Images that have
/// them are refused where they are not.
#ifdef MORPHBUS_VM_ALL_INSTRUCTIONS
inline constexpr bool kHoldsAllInstructions = true;
#else
inline constexpr bool kHoldsAllInstructions = !kSmallProfile;
#endif
/// True if images may bring names and source lines (vm/image/notes.cc), for people.
inline constexpr bool kHoldsNotes = !kSmallProfile;

// A module type.
// Masks over links, joints and connectors have 32 bits.
inline constexpr int kMaxLinks = Capacity(8, 3);
inline constexpr int kMaxJoints = Capacity(8, 2);
inline constexpr int kMaxConnectors = Capacity(24, 6);
inline constexpr int kMaxConnectorStates = Capacity(4, 1);  ///< State variables a connector.
inline constexpr int kMaxSensors = Capacity(12, 1);
/// Of all sensors: a tilt has three, others one.
inline constexpr int kMaxSensorValues = Capacity(16, 1);

// An assembly as one module sees it.
inline constexpr int kMaxNeighbours = Capacity(12, 4);  ///< Docked connectors at one time.
inline constexpr int kMaxBodyJoints = Capacity(64, 9);  ///< Joints known to touch one body.

// A program.
// Masks over roles and keywords have 64 bits, masks over routines and locals 16.
inline constexpr int kMaxRoles = Capacity(64, 14);
inline constexpr int kMaxFunctions = Capacity(512, 24);
inline constexpr int kMaxKeywords = Capacity(64, 32);
inline constexpr int kMaxFields = Capacity(32, 6);  ///< A role, with what it inherits.
inline constexpr int kMaxSharedFields =
    Capacity(4, 2);  ///< Of them, those that neighbours may read.
/// Of them, those whose values are told in every tick.
inline constexpr int kMaxTracedFields = Capacity(4, 0);
/// Kept fields that a module remembers, of all roles and programs that it has had.
inline constexpr int kMaxKeptFields = Capacity(16, 1);
inline constexpr int kMaxLabels = Capacity(16, 4);  ///< A role, with what it inherits.
/// Requirements of a role, with those that it inherits.
inline constexpr int kMaxRequirements = Capacity(16, 8);
inline constexpr int kMaxRoutines =
    Capacity(16, 4);  ///< Startups, behaviors, commands, handlers: each, a role.
/// Arguments of an invocation, a cell each.
inline constexpr int kMaxArguments = Capacity(4, 2);
/// Largest program image and largest kinematics image.
inline constexpr uint32_t kMaxImageBytes = Capacity<uint32_t>(65536, 8192);
/// A program on its way: its image behind a head (vm/spread/package.h).
inline constexpr uint32_t kPackageHeadBytes = 16;
inline constexpr uint32_t kMaxPackageBytes = kPackageHeadBytes + kMaxImageBytes;
/// No package is larger in any profile.
inline constexpr uint32_t kMostPackageBytes = kPackageHeadBytes + 65536;

// A running VM.
// The state of all this is one struct of fixed size (vm/run/state.h).
/// Tasks of a module that run or wait at one time.
inline constexpr int kMaxTasks = Capacity(12, 3);
inline constexpr int kStackCells =
    Capacity(40, 12);  ///< A task: locals and operands of all its frames.
/// Frames of a task: functions that call each other.
inline constexpr int kMaxCallDepth = Capacity(6, 3);
inline constexpr int kQueueDepth = Capacity(8, 4);  ///< Invocations waiting behind one command.
inline constexpr int kMaxPendingCommands = Capacity(64, 4);  ///< All queues of a module together.
inline constexpr int kMaxInvocations = Capacity(32, 8);      ///< Kept for forwarding.
inline constexpr int kMaxOrigins = Capacity(64, 4);  ///< Modules whose invocations are told apart.
/// Values that one print shows, and prints that a status holds; further ones are counted only.
inline constexpr int kMaxPrintValues = Capacity(6, 2);
inline constexpr int kMaxPrintsPerTick = Capacity(8, 1);
/// Faults that a status holds; further ones are counted only.
inline constexpr int kMaxFaultsPerTick = Capacity(8, 2);
/// Changes of parameters for which late messages are understood.
inline constexpr int kMaxFormerValues = Capacity(4, 2);
inline constexpr int kMaxRoleChanges = 8;  ///< In kRoleChangeWindowUs; one more freezes the role.
inline constexpr int kMaxRequests = Capacity(4, 1);  ///< Invocations from outside, a tick.

// What a body's joint table holds besides the joints that touch it: joints that are gone,
// remembered so that late news of them is not believed.
inline constexpr int kMaxBodyRecords = Capacity(96, 10);

// Times. Ticks of the control period, microseconds of sim time.
inline constexpr int64_t kRoleChangeWindowUs = 5000000;
inline constexpr int64_t kStallUs = 500000;   ///< Set-point there, joint not.
inline constexpr int64_t kTimerUs = 1000000;  ///< Period of on_timer, unless it says another.
inline constexpr float kMinPeriodS = 0.001f;  ///< Of timers, seconds.
inline constexpr float kMaxPeriodS = 1e6f;
inline constexpr int64_t kPoseStaleTicks = 10;  ///< Without a newer sequence of the root.
inline constexpr int64_t kNewsLateTicks = 3;    ///< The same: its part may have been cut off.
inline constexpr int64_t kSilentTicks = 50;     ///< A neighbour not heard so long holds nothing up.
inline constexpr int64_t kBodyMemoryTicks = 256;  ///< News older than this is never believed.
inline constexpr int16_t kClockDoubts = 100;  ///< Poses that overrule the root's clock as known.
inline constexpr int64_t kMaxTickAhead = 64;  ///< A message from further ahead is ignored.

// A neighbour message. Its fixed core and the pieces below stay under one datagram of 1400 bytes;
// what does not fit waits its turn.
/// Entries of each kind in one message.
inline constexpr int kMaxMessageBodyEntries = Capacity(48, 12);
inline constexpr int kMaxMessageInvocations = Capacity(6, 4);
inline constexpr int kMaxMessageAcks = Capacity(16, 2);
/// Of a program's package, at most: each module says what it can take (ProgramNews::piece_bytes).
inline constexpr int kFragmentBytes = Capacity(256, 32);

// Encoded sizes (lcmtypes/), by which the VM shares out the tail of a message.
inline constexpr int kBodyEntryWireBytes = 8;
inline constexpr int kInvocationWireBytes = 40;
inline constexpr int kAckWireBytes = 14;
inline constexpr int kFragmentWireBytes = kFragmentBytes + 24;
/// Bytes that the pieces above may take up together in one message.
inline constexpr int kMessageTailBytes = 820;

}  // namespace morphbus::vm
