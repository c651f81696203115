#pragma once
// What a module and its VM exchange in one tick. Plain structs: the bridge fills them from the bus,
// tests fill them by hand. Module ids are small numbers that the simulator (or the hardware's
// configuration) hands out; nothing here describes the assembly.
//
// Frames: R is the robot frame (north, up, east), L the frame of a link. Lengths are in metres and
// angles in radians unless a comment says otherwise.

#include <cstdint>

#include "vm/image/fault.h"
#include "vm/image/pose.h"
#include "vm/image/values.h"
#include "vm/limits.h"

namespace morphbus::vm {

/// What a connector's sensor says of the connector that is docked to it, its mate.
struct ConnectorReading {
  bool docked = false;
  uint16_t mate_module = 0;     ///< The neighbour that carries the mate.
  uint8_t mate_connector = 0;   ///< Number of the mate in the neighbour's module type.
  uint8_t connection_type = 0;  ///< Which `connection` of the model joins the two, from 0.
  /// The number of that connection, from 1, for which *this* module is member a.
  uint16_t number = 0;
  /// True where the connection cannot be described with this module as member a (its members are of
  /// unlike types, or its conditions hold one way round only). Then `number` is the neighbour's.
  bool is_member_b = false;

  /// True if both say the same.
  friend bool operator==(const ConnectorReading&, const ConnectorReading&) = default;
};

/// "Joint `joint` of module `module` touches this body", stamped by that module.
struct BodyEntry {
  uint8_t link = 0;  ///< In a message: the sender's DockedLink::body_link whose body is meant.
  /// The joint's number in its own module's type, and that module.
  uint8_t joint = 0;
  uint16_t module = 0;
  int32_t stamp = 0;  ///< The tick in which the module said so.
};

/// A remote invocation of a command on its way: every module that plays the role, or one that
/// extends it, runs the command once. Origin, incarnation and id together name an invocation.
struct Invocation {
  uint16_t origin = 0;  ///< The module that issued it.
  uint32_t origin_incarnation = 0;
  uint32_t id = 0;            ///< Counts the origin's invocations in that incarnation, from 1.
  uint64_t program_hash = 0;  ///< The invocation runs only under this image.
  /// The only module that runs it; -1 for all that play the role.
  int32_t target = -1;
  uint16_t role = 0;
  uint8_t command = 0;  ///< Slot in the role.
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

/// What a module tells its neighbours of one origin's invocations, so that they know which ones it
/// lacks and which ones it can still hand on. Ids of an origin count from 1 in each incarnation.
struct InvocationAck {
  uint16_t origin = 0;
  uint32_t origin_incarnation = 0;
  uint32_t id = 0;  ///< The module has all invocations of this origin up to this one.
  /// The module still keeps those from this one on; id + 1 if it keeps none. A neighbour that lacks
  /// older ones cannot get them here.
  uint32_t floor = 1;
};

/// A docked connector as its own module describes it: the neighbour there learns which of the links
/// it is docked to.
struct DockedLink {
  uint8_t connector = 0;
  uint8_t link = 0;       ///< The sender's link that carries the connector.
  uint8_t body_link = 0;  ///< Lowest of the links that fixed joints hold together with `link`.
  uint16_t mate_module = 0;
};

/// Which program a module has, and which piece of a newer one it asks its neighbours for. Only
/// ProgramRelay (vm/spread/program_relay.h) fills it in and reads it.
struct ProgramNews {
  /// Version of the newest program that the module has whole and verified, whether it runs or waits
  /// for its tick, and the id of its package. The highest version spreads; of equal versions the
  /// one with the larger id.
  uint32_t version = 0;
  uint64_t hash = 0;
  uint32_t want_version = 0;  ///< Version of the program it asks for; 0 if it asks for none.
  uint64_t want_hash = 0;
  uint32_t want_offset = 0;  ///< First byte of that program which it lacks.
  /// Bytes of the largest piece that it can take. On the bus, whose modules are all of one profile,
  /// it is not said.
  uint16_t piece_bytes = kFragmentBytes;
};

/// A piece of a program's package (vm/spread/package.h) on its way. The module that collects the
/// package checks it as a whole.
struct ProgramFragment {
  uint32_t version = 0;
  uint64_t hash = 0;        ///< The package's id.
  uint32_t image_size = 0;  ///< Size of the whole package, bytes.
  uint32_t offset = 0;      ///< Of the piece's first byte in the package.
  /// Bytes in the piece: as many as all neighbours can take, less for a package's last one, 0 if
  /// there is no piece.
  uint16_t size = 0;
  uint8_t bytes[kFragmentBytes] = {};
};

/// What a module tells its neighbours each tick (channel RUN/<module>/TRANSFORM).
struct NeighbourMessage {
  // Who speaks, in which of its lives, when, and under which program.
  uint16_t sender = 0;
  uint32_t incarnation = 0;
  int64_t tick = 0;
  uint64_t program_hash = 0;
  int16_t role = -1;  ///< Index in the program's role table; -1 while it has none.
  /// The values of the role's shared fields, in the order of their slots.
  uint8_t num_shared = 0;
  Cell shared[kMaxSharedFields];

  // Distributed forward kinematics: the pose that the root broadcasts, handed on link by link.
  bool has_pose = false;
  bool pose_stale = false;
  uint16_t root = 0;  ///< The module whose broadcast it is.
  uint32_t root_incarnation = 0;
  int64_t root_sequence = 0;  ///< The root's tick; newer ones replace older ones.
  uint16_t hops = 0;          ///< How many dockings the sender is away from the root.
  uint8_t num_links = 0;
  PoseF X_RL[kMaxLinks];  ///< Pose of each of the sender's links in the robot frame.

  // Bodies. Those too large for one message are told in `body_turns` messages in turn.
  // What is docked to the sender, and news about the joints that touch the bodies of its links.
  uint8_t num_docked = 0;
  DockedLink docked[kMaxNeighbours];
  uint8_t body_turns = 1;
  uint8_t num_body_entries = 0;
  BodyEntry body_entries[kMaxMessageBodyEntries];

  // Diffusion of invocations and programs.
  uint8_t num_invocations = 0;
  Invocation invocations[kMaxMessageInvocations];
  uint8_t num_acks = 0;
  InvocationAck acks[kMaxMessageAcks];
  ProgramNews news;
  ProgramFragment fragment;
};

/// An invocation from outside (a person's `morphbus control invoke`), given to any one module,
/// which issues it as its own.
struct InvokeRequest {
  uint64_t program_hash = 0;  ///< The request is refused under any other image.
  uint16_t role = 0;
  uint8_t command = 0;  ///< Slot in the role.
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

/// What a module is told when it is started, and how it is run. Nothing of it changes later, and
/// nothing of it describes the assembly.
struct VmConfig {
  /// Number that stands for the module in messages.
  uint16_t module_id = 0;
  uint32_t incarnation = 1;  ///< Counts cold starts, from 1.
  bool is_root = false;      ///< The root broadcasts the pose that ties the robot to R.
  uint8_t root_link = 0;     ///< Of the root: the link whose pose is broadcast.
  PoseF X_RL_root;           ///< Of the root: that link's pose in R, until a sensor says more.
  /// Ticks for which what a neighbour said is kept when its message is late. 0 in lockstep, where
  /// no message is late; a few where messages get lost for good.
  uint16_t grace_ticks = 0;
  /// Of the program's random numbers, with the module's id and incarnation; the run's.
  uint64_t random_seed = 1;
};

/// What a module senses and hears in one tick. Arrays are by number in the module's type; what lies
/// beyond its joints and connectors is not looked at.
struct TickInput {
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  double joint_position[kMaxJoints] = {};  ///< rad, or m for prismatic joints; the actuator's sign.
  double joint_velocity[kMaxJoints] = {};  ///< rad/s, or m/s for prismatic joints.
  /// What the motors exert: N m, or N for prismatic joints, positive where it drives the position
  /// up.
  float joint_effort[kMaxJoints] = {};
  /// What the root measures, if it has a sensor of its pose: X_RL of its link `root_link`. Used if
  /// that is VmConfig::root_link, and then for as long as nothing newer comes.
  bool has_root_pose = false;
  uint8_t root_link = 0;
  PoseF X_RL_root;
  /// What the sensors of the type measure, one behind the other (VerifiedKinematics::sensor).
  float sensor_values[kMaxSensorValues] = {};
  /// What each connector's sensor says, by number in the module's type.
  ConnectorReading connectors[kMaxConnectors];
  /// The previous tick's message of the neighbour on each connector; nullptr if none arrived. A
  /// message whose sender is not that neighbour is ignored.
  const NeighbourMessage* messages[kMaxConnectors] = {};
  /// What people ask this module to issue in this tick (morphbus control invoke).
  uint8_t num_requests = 0;
  InvokeRequest requests[kMaxRequests];
};

/// How an actuator is driven: it keeps its set-point, drives to a target, or turns at a speed.
enum class ActuatorMode : uint8_t { kHold, kPosition, kVelocity };

/// What one actuator shall do until the next tick, in its own sign; kHold uses neither number.
struct JointCommand {
  ActuatorMode mode = ActuatorMode::kHold;
  double target = 0;  ///< kPosition: rad, or m for prismatic joints.
  double speed = 0;   ///< kPosition: limit of the set-point's speed; kVelocity: the velocity.
};

/// A task that runs or waits.
struct TaskReport {
  TaskKind kind = TaskKind::kStartup;
  /// The function in which it stands, by number in the program.
  uint16_t function = 0;
  uint16_t pc = 0;    ///< Byte offset in it.
  uint16_t line = 0;  ///< Source line at which it stands; 0 where the module holds no notes.
};

/// A line that the program printed.
struct PrintReport {
  /// Where it was printed, as in a Fault.
  int16_t function = -1;
  uint16_t pc = 0;
  uint16_t line = 0;
  /// The text, by its number among the program's constants, and the values that it has places for.
  uint16_t text = 0;
  uint8_t num_values = 0;
  Cell values[kMaxPrintValues];
};

/// The value of a field that the program traces, at the end of the tick.
struct TraceReport {
  uint8_t field = 0;  ///< Its slot in the role held.
  Cell value;
};

/// Role, labels, conventions, tasks and faults of one tick (channel RUN/<module>/STATUS).
struct StatusReport {
  /// True if role, labels or conventions differ from the last tick, or if there are faults or
  /// prints: then the report is worth a message.
  bool changed = false;
  /// True if a fault has ended a startup of the role held: of its behaviors and commands none
  /// starts.
  bool startup_ended = false;
  int16_t role = -1;
  bool frozen = false;  ///< The role changed too often and stays as it is.
  /// Whether the module knows where it is in R, and whether that knowledge is old.
  bool has_pose = false, pose_stale = false;
  /// Labels of the role held; 0 without one.
  uint8_t num_labels = 0;
  int8_t labels[kMaxLabels];  ///< The own joint or link that each label slot names.
  int8_t signs[kMaxJoints];   ///< +1 or -1 under setJointAxis, 0 without a convention.
  /// Tasks that run or wait at the end of the tick.
  uint8_t num_tasks = 0;
  TaskReport tasks[kMaxTasks];
  /// Behaviors of the role held that a fault has ended, or that found no free task: they do not run
  /// again while it is held.
  uint8_t ended_behaviors = 0;
  uint8_t num_faults = 0;
  uint16_t faults_dropped = 0;  ///< Faults beyond kMaxFaultsPerTick, which are counted only.
  Fault faults[kMaxFaultsPerTick];
  uint8_t num_prints = 0;
  uint16_t prints_dropped = 0;  ///< Lines beyond kMaxPrintsPerTick, which are counted only.
  PrintReport prints[kMaxPrintsPerTick];
  uint8_t num_traces = 0;
  TraceReport traces[kMaxTracedFields > 0 ? kMaxTracedFields : 1];
};

/// An order to a connector's hardware, such as to extend its hooks.
struct ConnectorCommand {
  uint8_t connector = 0;
  uint8_t state = 0;  ///< Index into KinConnector::states.
  uint8_t value = 0;  ///< Index into the state's values.
};

/// All that a VM has to say after one tick.
struct TickOutput {
  /// What the neighbours hear in the next tick.
  NeighbourMessage message;
  /// One command for each joint of the module's type, by number.
  JointCommand joints[kMaxJoints];
  /// Orders to connectors in the order in which the program gave them.
  uint8_t num_connector_commands = 0;
  ConnectorCommand connector_commands[kMaxConnectors];
  /// What people and tools are told.
  StatusReport status;
};

}  // namespace morphbus::vm
