#pragma once
// All that changes in a VM, as one flat struct: saved and restored byte for byte, a VM goes on as
// if nothing had happened. Grouped by the part that writes it.
// Ticks and times are the module's own unless a comment says otherwise; times are sim time in
// microseconds.

#include <cstdint>
#include <type_traits>

#include "vm/image/pose.h"
#include "vm/image/values.h"
#include "vm/limits.h"
#include "vm/module_api.h"
#include "vm/run/interpreter.h"

namespace morphbus::vm {

/// What a connector's sensor says and what its neighbour's messages said. vm/space/neighbours.cc
/// writes it, one record for each own connector.
/// L is the frame of our docked link, K that of the neighbour's docked link.
struct NeighbourRecord {
  /// What the sensor says; all else holds only while something is docked.
  ConnectorReading sensor;

  /// True if the kinematics image has the connection; then X_LK holds.
  bool known = false;
  /// The pose of K in L (m), from the image.
  PoseF X_LK;

  /// True once the neighbour's messages have said which of its links is docked here.
  bool linked = false;
  /// That link, as in DockedLink::body_link.
  uint8_t neighbour_body_link = 0;
  /// The neighbour's role in our program; -1 if it has none there.
  int16_t role = -1;
  /// The role of which it has told the shared fields last, and their values; -1 before, and under
  /// another program.
  int16_t shared_role = -1;
  Cell shared[kMaxSharedFields];
  /// Which of its runs the neighbour is in; 0 before it was heard.
  uint32_t incarnation = 0;
  /// Our tick when it began anew, under a later incarnation; -1 if it did not, or has a role again.
  int64_t anew_tick = -1;
  /// Our tick when it was last heard, or docked.
  int64_t heard_tick = 0;
  /// Its own tick in its newest message; -1 before the first.
  int64_t message_tick = -1;
  /// True if place_L holds.
  bool has_place = false;
  /// The neighbour's place in L (m).
  Vec3 place_L;
};

/// The pose that was accepted last, and those that follow from it (vm/space/spatial.cc). R is the
/// robot frame.
struct PoseState {
  /// True once a pose has been accepted; the other fields hold from then on.
  bool has = false;
  /// True if nothing newer came for kPoseStaleTicks, and in real time for the ticks of grace
  /// besides.
  bool stale = false;
  /// The module that broadcast it.
  uint16_t root = 0;
  /// How many dockings the root is away.
  uint16_t hops = 0;
  /// The link whose pose came in.
  uint8_t entry_link = 0;
  /// The incarnation of the root that sent it.
  uint32_t root_incarnation = 0;
  /// The root's tick of the newest pose accepted.
  int64_t sequence = -1;
  /// Our tick when that happened.
  int64_t accepted_tick = 0;
  /// By how many ticks the root's clock (its tick) is ahead of ours (FollowClock).
  int64_t clock_ahead = 0;
  /// How many poses in a row have said more, or less, and the nearest that they said.
  int64_t clock_doubted = 0;
  int16_t clock_doubts = 0;
  /// The pose of the entry link's frame E in R (m).
  PoseF X_RE;
  /// The pose of each own link in R (m), by the present joint values.
  PoseF X_RL[kMaxLinks];
};

/// A joint known, or formerly known, to touch a body (vm/space/bodies.cc).
struct BodyRecord {
  /// The joint, by its module and its index there.
  uint16_t module = 0;
  uint8_t joint : 7 = 0;
  /// 0 if the joint is gone; the record stays so that late news is not believed.
  uint8_t live : 1 = 0;
  /// How many ticks the joint may go without news before it counts as gone.
  uint8_t grace_ticks = 0;
  /// The newest stamp accepted: a tick of the joint's module.
  int32_t stamp = 0;
  /// Our tick when that stamp came.
  int32_t refreshed_tick = 0;
};

/// All that is known of one body of which this module has a link.
struct BodyTable {
  /// How many records are in use.
  uint8_t num = 0;
  /// True if the fault of too many joints has been reported.
  bool overflow_told = false;
  /// The records, sorted by module and then by joint.
  BodyRecord records[kMaxBodyRecords];
};

/// Role, labels and what they rest on (vm/role/roles.cc).
struct RoleState {
  /// The role held; -1 without one.
  int16_t role = -1;
  /// True if the role changed too often; it then stays as it is.
  bool frozen = false;
  /// A role of the new program that goes on where the old program had one of that name; -1 without
  /// one, and from the first tick under the new program on.
  int16_t carried = -1;

  // What requirements rest on, and since when it has been the same.
  /// The digest of neighbours, bodies and presence of poses.
  uint64_t structure = 0;
  /// The digest of the neighbours' roles.
  uint64_t neighbour_roles = 0;
  /// The ticks since which the two digests have been the same.
  int64_t structure_since_tick = 0;
  int64_t roles_since_tick = 0;

  // On what the present role was decided, so that nothing is decided twice on the same evidence.
  /// True if evaluated_structure holds.
  bool evaluated = false;
  /// True if evaluated_roles holds as well.
  bool evaluated_roles_too = false;
  /// The digests on which the role was decided last.
  uint64_t evaluated_structure = 0;
  uint64_t evaluated_roles = 0;

  /// How many of the times below are in use.
  uint8_t num_changes = 0;
  /// The times of the last changes of role, the oldest first.
  int64_t change_us[kMaxRoleChanges] = {};
  /// The own joint or link of each label slot of the role.
  int8_t labels[kMaxLabels] = {};
  /// The values of the role's fields.
  Cell fields[kMaxFields];
};

/// What a kept field had last (vm/role/roles.cc).
struct KeptField {
  /// The digest of its name; 0: the place is free.
  uint64_t name = 0;
  ValueType type = ValueType::kVoid;
  Cell value;
};

/// The last change of programs (CarryOver in vm/role/roles.cc). Neighbours go over to the new one
/// in the same tick, but what they said before was said under the old one.
struct ProgramSwitch {
  /// The hash of the program that ran before; 0 if none did.
  uint64_t previous_hash = 0;
  /// The last tick computed under it.
  int64_t tick = 0;
  /// For each of its roles the one of the same name in the present program; -1 without one.
  int8_t renamed[kMaxRoles] = {};
};

/// Programs with the code of the present one and other values of parameters that ran before it, the
/// last one first; 0: none. What is said under them means the same.
struct FormerValues {
  uint64_t hashes[kMaxFormerValues] = {};
};

/// A joint's motion (vm/role/motion.cc). Degrees, or millimetres for a prismatic joint, in the
/// actuator's own sign; double, so that targets add up exactly.
struct JointState {
  /// Where the joint is to go.
  double target = 0;
  /// The set-point follows the target at the joint's speed, as the servo's does.
  double set_point = 0;
  /// Where the joint is, by its sensor.
  double measured = 0;
  /// The speed that turnContinuous asked for (units per second).
  double velocity = 0;
  /// True while the joint turns under turnContinuous.
  bool turning = false;
  /// True if the set-point has reached the target and the joint is close to it.
  bool arrived = true;
  bool stalled = false;
  /// The sign of the kinematic convention; 0 without one.
  int8_t sign = 0;
  /// The sign in which the program asked for the target or velocity.
  int8_t asked_sign = 1;
  /// The call that asked for it: its function, -1 without one, and the byte offset there.
  int16_t function = -1;
  uint16_t pc = 0;
  /// What the motor exerts, by its sensor (N m or N), in the actuator's own sign.
  float effort = 0;
  /// Since when the set-point is there and the joint is not, or a turning joint is too slow; -1 if
  /// that is not so.
  int64_t late_since_us = -1;
  /// How far a turning joint has turned the right way since then.
  double turned_late = 0;
};

/// What a task waits for.
enum class WaitKind : uint8_t { kNone, kNextTick, kSleep, kMotion };

/// A running or waiting task: a startup, behavior, command or handler (vm/role/scheduler.cc).
struct Task {
  /// False if this place in the table is free.
  bool used = false;
  TaskKind kind = TaskKind::kStartup;
  /// The index of the routine among the role's of that kind.
  uint8_t index = 0;
  WaitKind wait = WaitKind::kNone;
  /// The joint that must come to rest, for kMotion.
  uint8_t wait_joint = 0;
  /// True if its overrun has been reported since it last waited.
  bool budget_told = false;
  /// The function in which it stands, and the byte offset of the instruction there.
  uint16_t function = 0;
  uint32_t pc = 0;
  /// Of a behavior: the low 31 bits of the tick in which its present round began to run; -1 before.
  int32_t round_tick = -1;
  /// For kSleep the sim time at which it goes on; for kNextTick the tick in which it began to wait.
  int64_t wake_us = 0;
  /// Its calls and values.
  TaskState stack;
};

/// An invocation that waits until its command can start.
struct PendingCommand {
  /// The slot of the command in the role held.
  uint8_t slot = 0;
  /// The arguments, which have been found to fit.
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

/// Tasks and what waits to become one (vm/role/scheduler.cc, vm/run/task_queue.cc).
struct SchedulerState {
  /// False until the startups are done; nothing else runs before.
  bool startup_done = false;
  /// The task with which the next round begins.
  uint8_t next_task = 0;
  /// A bit for each behavior that faulted and does not repeat.
  uint16_t ended_behaviors = 0;
  /// How many invocations wait in `pending`.
  uint8_t num_pending = 0;
  /// When each handler that is a timer runs next.
  int64_t next_timer_us[kMaxRoutines] = {};
  /// For each handler of the role: a bit for each connector or joint that its event has come of and
  /// that it has not started on yet; bit 0 for timers.
  uint32_t event_subjects[kMaxRoutines] = {};
  /// The invocations in the order of their arrival.
  PendingCommand pending[kMaxPendingCommands];
  Task tasks[kMaxTasks];
};

/// An invocation kept until every neighbour has it (vm/spread/diffusion.cc).
struct KeptInvocation {
  Invocation invocation;
  /// A mask of the connectors whose neighbours have it.
  uint32_t acked_connectors = 0;
};

/// What is known of one module's invocations in one of its incarnations.
struct OriginRecord {
  uint16_t module = 0;
  uint32_t incarnation = 0;
  /// All ids up to this one have arrived, or are gone for good.
  uint32_t have = 0;
  /// The tick since which neighbours offer only later ids; -1 if they do not.
  int64_t gap_since_tick = -1;
  /// The tick in which the module was first heard of.
  int64_t learned_tick = 0;
};

/// Invocations under way (vm/spread/diffusion.cc).
struct DiffusionState {
  /// The id of the last invocation issued here.
  uint32_t own_id = 0;
  /// How many records of `kept` and of `origins` are in use.
  uint8_t num_kept = 0;
  uint8_t num_origins = 0;
  /// The origin whose acknowledgement comes next in turn.
  uint8_t next_ack = 0;
  /// The tick since which `kept` has had no room; -1 if it has some.
  int64_t full_since_tick = -1;
  /// The invocations in the order of their arrival.
  KeptInvocation kept[kMaxInvocations];
  /// The origins, sorted by module and then by incarnation.
  OriginRecord origins[kMaxOrigins];
};

/// The whole state of a VM. The Vm owns it; a snapshot is its bytes.
struct VmState {
  /// True once a first tick has been computed.
  bool started = false;
  /// The number and the sim time of the last tick computed.
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  /// How long the last tick was (sim time); 0 before the second.
  int64_t period_us = 0;
  /// How many random numbers have been drawn.
  uint64_t random_count = 0;
  /// True if more docked connectors than there is room for have been reported.
  bool neighbours_told = false;
  /// The digest of the last status (vm/vm.cc).
  uint64_t reported = 0;
  /// The value that the program has set each connector's state variables to; 0 before.
  uint8_t connector_values[kMaxConnectors][kMaxConnectorStates] = {};
  /// What the sensors measured in the last tick (TickInput).
  float sensor_values[kMaxSensorValues] = {};
  NeighbourRecord neighbours[kMaxConnectors];
  PoseState pose;
  /// By body link (VerifiedKinematics::BodyLink); the entries of other links are empty.
  BodyTable bodies[kMaxLinks];
  RoleState role;
  /// The values of kept fields, the one that was told last first.
  KeptField kept[kMaxKeptFields];
  ProgramSwitch program_switch;
  FormerValues former_values;
  JointState joints[kMaxJoints];
  SchedulerState scheduler;
  DiffusionState diffusion;
};
static_assert(std::is_trivially_copyable_v<VmState>);
static_assert(std::is_standard_layout_v<VmState>);

}  // namespace morphbus::vm
