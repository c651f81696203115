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
  /// Set where the connection cannot be described with this module as member a (its members are of
  /// unlike types, or its conditions hold one way round only): `number` is then the mate's.
  bool is_member_b = false;
};

/// "Joint `joint` of module `module` touches this body", stamped by its origin.
struct BodyEntry {
  uint8_t link = 0;  ///< In a message: the sender's DockedLink::body_link whose body is meant.
  uint8_t joint = 0;
  uint16_t module = 0;
  int64_t stamp = 0;  ///< Origin's tick.
};

/// A remote invocation on its way.
struct Invocation {
  uint16_t origin = 0;
  uint32_t origin_incarnation = 0;
  uint32_t id = 0;            ///< 1, 2, 3 … per origin and incarnation.
  uint64_t program_hash = 0;  ///< It runs only under this image.
  uint16_t role = 0;
  uint8_t command = 0;  ///< Slot.
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

/// "I have all invocations of this origin up to `id`, and still keep those from `floor` on."
struct InvocationAck {
  uint16_t origin = 0;
  uint32_t origin_incarnation = 0;
  uint32_t id = 0;
  uint32_t floor =
      1;  ///< id + 1 if none is kept. A mate that lacks older ones cannot get them here.
};

struct DockedLink {
  uint8_t connector = 0;
  uint8_t link = 0;       ///< The sender's link that carries it.
  uint8_t body_link = 0;  ///< Lowest of the links that fixed joints hold together with `link`.
  uint16_t mate_module = 0;
};

/// Which program a module holds and which piece of a newer one it asks its mates for; filled in and
/// read by ProgramRelay (vm/program_relay.h) alone.
struct ProgramNews {
  uint32_t version = 0;  ///< Of the program it runs; the highest version spreads, then the hash.
  uint64_t hash = 0;
  uint32_t want_version = 0;  ///< 0: wants nothing.
  uint64_t want_hash = 0;
  uint32_t want_offset = 0;  ///< First byte it lacks.
};

/// A piece of a program image on its way.
struct ProgramFragment {
  uint32_t version = 0;
  uint64_t hash = 0;
  uint32_t image_size = 0;
  uint32_t offset = 0;  ///< A multiple of kFragmentBytes.
  uint16_t size = 0;    ///< 0: no fragment. kFragmentBytes but for the last one.
  uint8_t bytes[kFragmentBytes] = {};
};

/// What a module tells its neighbours each tick (channel RUN/<module>/TRANSFORM).
struct NeighbourMessage {
  uint16_t sender = 0;
  uint32_t incarnation = 0;
  int64_t tick = 0;
  uint64_t program_hash = 0;
  int16_t role = -1;  ///< Index in the program's role table; -1 while it has none.
  // Distributed forward kinematics.
  bool has_pose = false;
  bool pose_stale = false;
  uint16_t root = 0;
  uint32_t root_incarnation = 0;
  int64_t root_sequence = 0;
  uint16_t hops = 0;
  uint8_t num_links = 0;
  PoseF X_RL[kMaxLinks];  ///< Pose of each link in the robot frame.
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
  ProgramNews news;
  ProgramFragment fragment;
};

/// An invocation from outside (a person's `morphbus invoke`), given to any one module, which issues
/// it as its own.
struct InvokeRequest {
  uint64_t program_hash = 0;  ///< Refused under any other image.
  uint16_t role = 0;
  uint8_t command = 0;  ///< Slot.
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

/// What a module is told when it is started (its id, whether it is the root), and how it is run.
struct VmConfig {
  uint16_t module_id = 0;
  uint32_t incarnation = 1;  ///< Counts cold starts, from 1.
  bool is_root = false;
  uint8_t root_link = 0;  ///< The link whose pose is broadcast.
  PoseF X_RL_root;        ///< Its pose in the robot frame (m).
  /// Ticks for which what a mate said is kept when its message is late. 0 in lockstep, where none
  /// is; a few where messages get lost for good.
  uint16_t grace_ticks = 0;
};

struct TickInput {
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  double joint_position[kMaxJoints] = {};  ///< rad or m, raw actuator sign.
  double joint_velocity[kMaxJoints] = {};
  ConnectorReading connectors[kMaxConnectors];
  /// Message of the mate on each connector from the previous tick; nullptr if none arrived. A
  /// message whose sender is not the connector's mate is ignored.
  const NeighbourMessage* messages[kMaxConnectors] = {};
  uint8_t num_requests = 0;
  InvokeRequest requests[kMaxRequests];
};

enum class ActuatorMode : uint8_t { kHold, kPosition, kVelocity };

struct JointCommand {
  ActuatorMode mode = ActuatorMode::kHold;
  double target = 0;  ///< rad or m (kPosition), raw actuator sign.
  double speed = 0;   ///< Limit of the set-point's speed (kPosition) or the velocity (kVelocity).
};

struct Fault {
  FaultCode code = FaultCode::kNone;
  int16_t role = -1;
  int16_t function = -1;  ///< -1: no source position.
  uint16_t line = 0;
  int16_t joint = -1;
  float value = 0;  ///< e.g. the angle asked for, degrees (mm for prismatic joints).
  float limit = 0;
  Axis axis = Axis::kAny;  ///< kAxisNotAligned: the axis that setJointAxis asked for, and
  Vec3 direction_R;        ///< where the joint's axis points, robot frame (unit).
};

enum class TaskKind : uint8_t { kStartup, kBehavior, kCommand, kHandler };

struct TaskReport {
  TaskKind kind = TaskKind::kStartup;
  uint16_t function = 0;
  uint16_t line = 0;  ///< Where it stands.
};

/// Role, labels, conventions, tasks (channel RUN/<module>/STATUS).
struct StatusReport {
  bool changed = false;  ///< Role, labels or conventions differ from the last tick, or faults.
  int16_t role = -1;
  bool frozen = false;  ///< Role changed too often.
  bool has_pose = false, pose_stale = false;
  uint8_t num_labels = 0;
  int8_t labels[kMaxLabels];  ///< Own joint or link index of each label slot.
  int8_t signs[kMaxJoints];   ///< +1 or -1 under setJointAxis, 0 without a convention.
  uint8_t num_tasks = 0;
  TaskReport tasks[kMaxTasks];
  uint8_t num_faults = 0;
  uint16_t faults_dropped = 0;  ///< Beyond kMaxFaultsPerTick.
  Fault faults[kMaxFaultsPerTick];
};

struct ConnectorCommand {
  uint8_t connector = 0;
  uint8_t state = 0;  ///< Index into KinConnector::states.
  uint8_t value = 0;  ///< Index into the state's values.
};

struct TickOutput {
  NeighbourMessage message;
  JointCommand joints[kMaxJoints];
  uint8_t num_connector_commands = 0;
  ConnectorCommand connector_commands[kMaxConnectors];
  StatusReport status;
};

}  // namespace morphbus::vm
