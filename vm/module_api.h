#pragma once
// What a module and its VM exchange in one tick. Plain structs: the bridge fills them from the bus,
// tests fill them by hand. Module ids are small numbers that the simulator (or the hardware's
// configuration) hands out; nothing here describes the assembly.

#include <cstdint>

#include "vm/limits.h"
#include "vm/pose.h"
#include "vm/values.h"

namespace morphbus::vm {

/// A connector's sensor.
struct ConnectorReading {
  bool docked = false;
  uint16_t mate_module = 0;
  uint8_t mate_connector = 0;
  uint8_t connection_type = 0;
  uint16_t number = 0;  ///< The connection's number for which *this* module is member a.
};

/// "Joint `joint` of module `module` touches this body", stamped by its origin.
struct BodyEntry {
  uint8_t link = 0;      ///< In a message: the sender's link whose body is meant.
  uint8_t joint = 0;
  uint16_t module = 0;
  int64_t stamp = 0;     ///< Origin's tick.
};

/// A remote invocation on its way.
struct Invocation {
  uint16_t origin = 0;
  uint32_t origin_incarnation = 0;
  uint32_t id = 0;             ///< 1, 2, 3 … per origin and incarnation.
  uint64_t program_hash = 0;   ///< It runs only under this image.
  uint16_t role = 0;
  uint8_t command = 0;         ///< Slot.
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

/// "I have all invocations of this origin up to id."
struct InvocationAck {
  uint16_t origin = 0;
  uint32_t origin_incarnation = 0;
  uint32_t id = 0;
};

struct DockedLink {
  uint8_t connector = 0;
  uint8_t link = 0;       ///< The sender's link that carries it.
  uint16_t mate_module = 0;
};

/// What a module tells its neighbours each tick (channel RUN/<module>/TRANSFORM).
struct NeighbourMessage {
  uint16_t sender = 0;
  uint32_t incarnation = 0;
  int64_t tick = 0;
  uint64_t program_hash = 0;
  int16_t role = -1;             ///< Index in the program's role table; -1 while it has none.
  // Distributed forward kinematics.
  bool has_pose = false;
  bool pose_stale = false;
  uint16_t root = 0;
  uint32_t root_incarnation = 0;
  int64_t root_sequence = 0;
  uint16_t hops = 0;
  uint8_t num_links = 0;
  PoseF X_RL[kMaxLinks];         ///< Pose of each link in the robot frame.
  // Bodies; a body too large for one message is sent in `body_turns` messages in turn.
  uint8_t num_docked = 0;
  DockedLink docked[kMaxNeighbours];
  uint8_t body_turns = 1;
  uint8_t num_body_entries = 0;
  BodyEntry body_entries[kMaxMessageBodyEntries];
  // Diffusion.
  uint8_t num_invocations = 0;
  Invocation invocations[kMaxMessageInvocations];
  uint8_t num_acks = 0;
  InvocationAck acks[kMaxMessageAcks];
};

struct TickInput {
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  double joint_position[kMaxJoints] = {};   ///< rad or m, raw actuator sign.
  double joint_velocity[kMaxJoints] = {};
  ConnectorReading connectors[kMaxConnectors];
  /// Message of the mate on each connector from the previous tick; nullptr if none arrived.
  const NeighbourMessage* messages[kMaxConnectors] = {};
};

enum class ActuatorMode : uint8_t { kHold, kPosition, kVelocity };

struct JointCommand {
  ActuatorMode mode = ActuatorMode::kHold;
  double target = 0;   ///< rad or m (kPosition), raw actuator sign.
  double speed = 0;    ///< Limit of the set-point's speed (kPosition) or the velocity (kVelocity).
};

struct Fault {
  FaultCode code = FaultCode::kNone;
  int16_t role = -1;
  int16_t function = -1;  ///< -1: no source position.
  uint16_t line = 0;
  int16_t joint = -1;
  float value = 0;        ///< e.g. the angle asked for, degrees.
  float limit = 0;
};

enum class TaskKind : uint8_t { kStartup, kBehavior, kCommand, kHandler };

struct TaskReport {
  TaskKind kind = TaskKind::kStartup;
  uint16_t function = 0;
  uint16_t line = 0;       ///< Where it stands.
};

/// Role, labels, conventions, tasks (channel RUN/<module>/STATUS).
struct StatusReport {
  bool changed = false;    ///< Role, labels or conventions differ from the last tick, or faults.
  int16_t role = -1;
  bool frozen = false;     ///< Role changed too often.
  bool has_pose = false, pose_stale = false;
  uint8_t num_labels = 0;
  int8_t labels[kMaxLabels];        ///< Own joint or link index of each label slot.
  int8_t signs[kMaxJoints];         ///< +1 or -1 under setJointAxis, 0 without a convention.
  uint8_t num_tasks = 0;
  TaskReport tasks[kMaxTasks];
  uint8_t num_faults = 0;
  uint16_t faults_dropped = 0;      ///< Beyond kMaxFaultsPerTick.
  Fault faults[kMaxFaultsPerTick];
};

struct ConnectorCommand {
  uint8_t connector = 0;
  uint8_t state = 0;      ///< Index into KinConnector::states.
  uint8_t value = 0;      ///< Index into the state's values.
};

struct TickOutput {
  NeighbourMessage message;
  JointCommand joints[kMaxJoints];
  uint8_t num_connector_commands = 0;
  ConnectorCommand connector_commands[kMaxConnectors];
  StatusReport status;
};

}  // namespace morphbus::vm
