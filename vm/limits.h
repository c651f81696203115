#pragma once
// Every fixed capacity of the VM. Overflow of any of them is a fault, never silent.

#include <cstdint>

namespace morphbus::vm {

// A module type.
inline constexpr int kMaxLinks = 8;
inline constexpr int kMaxJoints = 8;
inline constexpr int kMaxConnectors = 24;
inline constexpr int kMaxConnectorStates = 4;  ///< State variables a connector.

// An assembly as one module sees it.
inline constexpr int kMaxNeighbours = 12;   ///< Docked connectors at one time.
inline constexpr int kMaxBodyJoints = 64;   ///< Joints known to touch one body.

// A program.
inline constexpr int kMaxRoles = 64;
inline constexpr int kMaxFunctions = 512;
inline constexpr int kMaxKeywords = 64;
inline constexpr int kMaxFields = 16;    ///< A role, with what it inherits.
inline constexpr int kMaxLabels = 16;    ///< A role, with what it inherits.
inline constexpr int kMaxRequirements = 16;
inline constexpr int kMaxRoutines = 16;  ///< Startups, behaviors, commands, handlers: each, a role.
inline constexpr int kMaxArguments = 4;
inline constexpr uint32_t kMaxImageBytes = 65536;

// A running VM.
inline constexpr int kMaxTasks = 12;
inline constexpr int kStackCells = 40;   ///< A task: locals and operands of all its frames.
inline constexpr int kMaxCallDepth = 6;
inline constexpr int kQueueDepth = 8;    ///< Invocations waiting behind one command.
inline constexpr int kMaxInvocations = 32;  ///< Kept for forwarding.
inline constexpr int kMaxOrigins = 64;      ///< Modules whose invocations are told apart.
inline constexpr int kMaxFaultsPerTick = 8;

// A neighbour message (fits one datagram of 1400 bytes with its envelope).
inline constexpr int kMaxMessageBodyEntries = 48;
inline constexpr int kMaxMessageInvocations = 6;
inline constexpr int kMaxMessageAcks = 16;

}  // namespace morphbus::vm
