#pragma once
// Every fixed capacity of the VM. Overflow of any of them is a fault, never silent. The VM uses no
// heap, so its state and its messages are as large as these say (vm/run/state.h). The compiler and
// the verifier refuse programs and module types that exceed them.

#include <cstdint>

namespace morphbus::vm {

// A module type.
// Masks over links, joints and connectors have 32 bits.
inline constexpr int kMaxLinks = 8;
inline constexpr int kMaxJoints = 8;
inline constexpr int kMaxConnectors = 24;
inline constexpr int kMaxConnectorStates = 4;  ///< State variables a connector.

// An assembly as one module sees it.
inline constexpr int kMaxNeighbours = 12;  ///< Docked connectors at one time.
inline constexpr int kMaxBodyJoints = 64;  ///< Joints known to touch one body.

// A program.
// Masks over roles and keywords have 64 bits, masks over routines and locals 16.
inline constexpr int kMaxRoles = 64;
inline constexpr int kMaxFunctions = 512;
inline constexpr int kMaxKeywords = 64;
inline constexpr int kMaxFields = 16;  ///< A role, with what it inherits.
inline constexpr int kMaxLabels = 16;  ///< A role, with what it inherits.
/// Requirements of a role, with those that it inherits.
inline constexpr int kMaxRequirements = 16;
inline constexpr int kMaxRoutines = 16;  ///< Startups, behaviors, commands, handlers: each, a role.
/// Arguments of an invocation, a cell each.
inline constexpr int kMaxArguments = 4;
/// Largest program image and largest kinematics image.
inline constexpr uint32_t kMaxImageBytes = 65536;

// A running VM.
// The state of all this is one struct of fixed size (vm/run/state.h).
/// Tasks of a module that run or wait at one time.
inline constexpr int kMaxTasks = 12;
inline constexpr int kStackCells = 40;  ///< A task: locals and operands of all its frames.
/// Frames of a task: functions that call each other.
inline constexpr int kMaxCallDepth = 6;
inline constexpr int kQueueDepth = 8;           ///< Invocations waiting behind one command.
inline constexpr int kMaxPendingCommands = 64;  ///< All queues of a module together.
inline constexpr int kMaxInvocations = 32;      ///< Kept for forwarding.
inline constexpr int kMaxOrigins = 64;          ///< Modules whose invocations are told apart.
/// Faults that a status holds; further ones are counted only.
inline constexpr int kMaxFaultsPerTick = 8;
inline constexpr int kMaxRoleChanges = 8;  ///< In kRoleChangeWindowUs; one more freezes the role.
inline constexpr int kMaxRequests = 4;     ///< Invocations from outside, a tick.

// What a body's joint table holds besides the joints that touch it: joints that are gone,
// remembered so that late news of them is not believed.
inline constexpr int kMaxBodyRecords = 96;

// Times. Ticks of the control period, microseconds of sim time.
inline constexpr int64_t kRoleChangeWindowUs = 5000000;
inline constexpr int64_t kStallUs = 500000;     ///< Set-point there, joint not.
inline constexpr int64_t kTimerUs = 1000000;    ///< Period of on_timer.
inline constexpr int64_t kPoseStaleTicks = 10;  ///< Without a newer sequence of the root.
inline constexpr int64_t kSilentTicks = 50;     ///< A neighbour not heard so long holds nothing up.
inline constexpr int64_t kBodyMemoryTicks = 256;  ///< News older than this is never believed.
inline constexpr int64_t kMaxTickAhead = 64;      ///< A message from further ahead is ignored.

// A neighbour message. Its fixed core and the pieces below stay under one datagram of 1400 bytes;
// what does not fit waits its turn.
/// Entries of each kind in one message.
inline constexpr int kMaxMessageBodyEntries = 48;
inline constexpr int kMaxMessageInvocations = 6;
inline constexpr int kMaxMessageAcks = 16;
inline constexpr int kFragmentBytes = 256;  ///< Of a program image.

// Encoded sizes (lcmtypes/), by which the VM shares out the tail of a message.
inline constexpr int kBodyEntryWireBytes = 8;
inline constexpr int kInvocationWireBytes = 40;
inline constexpr int kAckWireBytes = 14;
inline constexpr int kFragmentWireBytes = kFragmentBytes + 24;
/// Bytes that the pieces above may take up together in one message.
inline constexpr int kMessageTailBytes = 820;

}  // namespace morphbus::vm
