#pragma once
// All that changes in a VM, as one flat struct: saved and restored byte for byte, a VM goes on as
// if nothing had happened. Grouped by the part that writes it.

#include <cstdint>
#include <type_traits>

#include "vm/interpreter.h"
#include "vm/limits.h"
#include "vm/module_api.h"
#include "vm/pose.h"
#include "vm/values.h"

namespace morphbus::vm {

/// What a connector's sensor and its mate's messages say (vm/mates.cc).
struct MateRecord {
  bool docked = false;
  bool has_place = false;  ///< place_L holds.
  bool known = false;      ///< The connection is in the kinematics image.
  bool is_member_b = false;
  uint8_t mate_connector = 0;
  uint8_t connection_type = 0;
  uint8_t mate_body_link =
      0;                ///< The mate's link that is docked here, as in DockedLink::body_link.
  bool linked = false;  ///< The mate has said which of its links is docked here.
  uint16_t module = 0;
  uint16_t number = 0;
  int16_t role = -1;          ///< The mate's role in our program; -1 if none or another program.
  uint32_t incarnation = 0;   ///< 0 before the mate was heard.
  int64_t heard_tick = 0;     ///< Our tick when it was last heard (or docked).
  int64_t message_tick = -1;  ///< The mate's tick of its newest message.
  PoseF X_LK;                 ///< K: the mate's docked link's frame, in ours (m).
  Vec3 place_L;               ///< The mate's place in the frame of our docked link (m).
};

/// Distributed forward kinematics (vm/spatial.cc).
struct PoseState {
  bool has = false;
  bool stale = false;
  uint16_t root = 0;
  uint16_t hops = 0;
  uint8_t entry_link = 0;  ///< The link whose pose came in.
  uint32_t root_incarnation = 0;
  int64_t sequence = -1;  ///< Newest accepted.
  int64_t accepted_tick = 0;
  PoseF X_RE;  ///< E: frame of the entry link.
  PoseF X_RL[kMaxLinks];
};

/// A joint known, or formerly known, to touch a body (vm/bodies.cc).
struct BodyRecord {
  uint16_t module = 0;
  uint8_t joint = 0;
  uint8_t live = 0;      ///< 0: gone; kept so that its old stamps are not believed again.
  uint8_t patience = 0;  ///< Ticks it may go without news.
  int32_t stamp = 0;     ///< Newest accepted (a tick).
  int32_t refreshed_tick = 0;
};

struct BodyTable {
  uint8_t num = 0;
  bool overflow_told = false;
  BodyRecord records[kMaxBodyRecords];  ///< Sorted by module, then joint.
};

/// Role, labels and what they rest on (vm/roles.cc).
struct RoleState {
  int16_t role = -1;
  bool frozen = false;
  bool evaluated = false;            ///< evaluated_structure holds.
  bool evaluated_roles_too = false;  ///< evaluated_roles holds as well.
  uint64_t structure = 0;            ///< Digest of neighbours, bodies, presence of poses.
  uint64_t neighbour_roles = 0;      ///< Digest of the neighbours' roles.
  uint64_t evaluated_structure = 0;
  uint64_t evaluated_roles = 0;
  int64_t structure_since_tick = 0;
  int64_t roles_since_tick = 0;
  uint8_t num_changes = 0;
  int64_t change_us[kMaxRoleChanges] = {};  ///< Times of the last changes, oldest first.
  int8_t labels[kMaxLabels] = {};
  Cell fields[kMaxFields];
};

/// A joint's motion (vm/motion.cc). Degrees, or millimetres for a prismatic joint, in the
/// actuator's own sign; double, so that targets add up exactly.
struct JointState {
  double target = 0;
  double set_point = 0;  ///< Follows the target at the joint's speed, as the servo's does.
  double measured = 0;
  double velocity = 0;   ///< Asked for by turnContinuous, units per second.
  bool turning = false;  ///< Under turnContinuous.
  bool arrived = true;
  bool stalled = false;
  int8_t sign = 0;             ///< Kinematic convention; 0 without one.
  int64_t late_since_us = -1;  ///< Set-point there, joint not; -1 if that is not so.
};

enum class WaitKind : uint8_t { kNone, kNextTick, kSleep, kMotion };

/// A task (vm/scheduler.cc).
struct Task {
  bool used = false;
  TaskKind kind = TaskKind::kStartup;
  uint8_t index = 0;  ///< Of the routine among the role's of that kind.
  WaitKind wait = WaitKind::kNone;
  uint8_t wait_joint = 0;
  bool budget_told = false;  ///< Its overrun has been reported since it last waited.
  uint16_t function = 0;     ///< Where it stands:
  uint32_t pc = 0;
  int64_t wake_us = 0;
  TaskState stack;
};

struct PendingCommand {
  uint8_t slot = 0;
  uint8_t num_arguments = 0;
  Cell arguments[kMaxArguments];
};

struct SchedulerState {
  bool startup_done = false;
  uint8_t next_task = 0;         ///< Where the round begins.
  uint16_t ended_behaviors = 0;  ///< Behaviors that faulted and do not repeat, bit mask.
  uint8_t num_pending = 0;
  int64_t next_timer_us = 0;
  uint8_t event_pending[kMaxRoutines] = {};  ///< Per handler of the role.
  uint8_t event_subject[kMaxRoutines] = {};  ///< Connector or joint it is about.
  PendingCommand pending[kMaxPendingCommands];
  Task tasks[kMaxTasks];
};

/// An invocation kept until every mate has it (vm/diffusion.cc).
struct KeptInvocation {
  Invocation invocation;
  uint32_t acked_connectors = 0;  ///< Bit mask.
};

struct OriginRecord {
  uint16_t module = 0;
  uint32_t incarnation = 0;
  uint32_t have = 0;            ///< All ids up to this one have arrived (or are gone for good).
  int64_t gap_since_tick = -1;  ///< Since when mates offer only later ids; -1 if they do not.
  int64_t learned_tick = 0;     ///< When it was first heard of.
};

struct DiffusionState {
  uint32_t own_id = 0;  ///< Of the last invocation issued here.
  uint8_t num_kept = 0;
  uint8_t num_origins = 0;
  uint8_t next_ack = 0;
  int64_t full_since_tick = -1;
  KeptInvocation kept[kMaxInvocations];  ///< In order of arrival.
  OriginRecord origins[kMaxOrigins];     ///< Sorted by module, then incarnation.
};

struct VmState {
  bool started = false;  ///< A first tick has been computed.
  int64_t tick = 0;
  int64_t sim_time_us = 0;
  bool neighbours_told = false;  ///< More docked connectors than capacity: reported.
  uint64_t reported = 0;         ///< Digest of the last status (vm/vm.cc).
  MateRecord mates[kMaxConnectors];
  PoseState pose;
  BodyTable bodies[kMaxLinks];  ///< By body link (VerifiedKinematics::BodyLink).
  RoleState role;
  JointState joints[kMaxJoints];
  SchedulerState scheduler;
  DiffusionState diffusion;
};
static_assert(std::is_trivially_copyable_v<VmState>);
static_assert(std::is_standard_layout_v<VmState>);

}  // namespace morphbus::vm
