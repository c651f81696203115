// Holds the ranges of lcmtypes/*.lcm, which are numbers for readers in any language, to the limits
// of the code. There is nothing here but for the compiler.

#include <algorithm>

#include "bridge/wire/channels.h"
#include "bridge/wire/status_codec.h"
#include "bridge/wire/wire_limits.h"
#include "bridge/wire/wire_size.h"
#include "vm/image/directions.h"
#include "vm/image/fault.h"
#include "vm/image/image.h"
#include "vm/limits.h"
#include "vm/run/state.h"

namespace morphbus::bridge {
namespace {

/// Whether the highest value of a number, or the longest length of a text, is `highest` in each of
/// these types.
template <class... M>
constexpr bool Highest(std::string_view field, int64_t highest) {
  return ((FieldOf<M>(field).highest == highest) && ...);
}

// The parts of a module.
static_assert(Highest<body_pose_t, contact_force_t, root_pose_t, docked_link_t, body_entry_t,
                      fault_t>("link", vm::kMaxLinks - 1));
static_assert(Highest<docked_link_t>("body_link", vm::kMaxLinks - 1));
static_assert(Highest<transform_t>("num_links", vm::kMaxLinks));
static_assert(Highest<body_entry_t, fault_t>("joint", vm::kMaxJoints - 1));
static_assert(Highest<module_sensors_t, actuator_t, status_t>("num_joints", vm::kMaxJoints));
static_assert(Highest<label_t>("index", std::max(vm::kMaxLinks, vm::kMaxJoints) - 1));
static_assert(Highest<docked_connector_t, docked_link_t, connector_command_t, fault_t>(
    "connector", vm::kMaxConnectors - 1));
static_assert(Highest<docked_connector_t>("mate_connector", vm::kMaxConnectors - 1));
static_assert(Highest<actuator_t>("num_connectors", vm::kMaxConnectors));
static_assert(Highest<connector_command_t>("state", vm::kMaxConnectorStates - 1));
static_assert(Highest<module_sensors_t, transform_t>("num_docked", vm::kMaxNeighbours));
static_assert(Highest<module_sensors_t>("num_sensor_values", vm::kMaxSensorValues));

// A program and what runs of it.
static_assert(Highest<invoke_request_t, invocation_t, transform_t, status_t, fault_t>(
    "role", vm::kMaxRoles - 1));
static_assert(Highest<fault_t>("rival_role", vm::kMaxRoles - 1));
static_assert(Highest<invoke_request_t, invocation_t>("command", vm::kMaxRoutines - 1));
static_assert(Highest<invoke_request_t, invocation_t>("num_arguments", vm::kMaxArguments));
static_assert(Highest<status_t>("ended_behaviors", vm::kMaxRoutines));
static_assert(Highest<fault_t, print_t>("function_index", vm::kMaxFunctions - 1));
static_assert(Highest<fault_t>("task_function", vm::kMaxFunctions - 1));
static_assert(Highest<fault_t>("keyword", vm::kMaxKeywords - 1));
static_assert(Highest<fault_t>("code", vm::kNumFaultCodes - 1));
static_assert(Highest<fault_t>("asked_axis", vm::kNumAxes - 1));
constexpr auto kLastTaskKind = static_cast<int64_t>(vm::TaskKind::kHandler);
static_assert(Highest<task_t, held_task_t>("kind", kLastTaskKind));
static_assert(Highest<fault_t>("ended_task", kLastTaskKind));
static_assert(Highest<held_task_t>("wait", static_cast<int64_t>(vm::WaitKind::kMotion)));
static_assert(Highest<held_task_t>("number", vm::kMaxTasks - 1));
static_assert(Highest<held_task_t>("num_calls", vm::kMaxCallDepth));
static_assert(Highest<call_t>("number", vm::kMaxCallDepth - 1));
static_assert(Highest<call_t>("num_locals", vm::image::kMaxLocals));
static_assert(Highest<status_t, inspection_t>("num_tasks", vm::kMaxTasks));
static_assert(Highest<inspection_t>("num_fields", vm::kMaxFields));
static_assert(Highest<transform_t>("num_shared", vm::kMaxSharedFields));
static_assert(Highest<status_t>("num_labels", vm::kMaxLabels));
static_assert(Highest<status_t>("num_faults", vm::kMaxFaultsPerTick));
static_assert(Highest<status_t>("num_prints", vm::kMaxPrintsPerTick));
static_assert(Highest<print_t>("num_values", vm::kMaxPrintValues));

// What spreads from module to module, and orders from outside.
static_assert(Highest<sensors_t>("num_requests", vm::kMaxRequests));
static_assert(Highest<transform_t>("num_body_entries", vm::kMaxMessageBodyEntries));
static_assert(Highest<transform_t>("num_invocations", vm::kMaxMessageInvocations));
static_assert(Highest<transform_t>("num_acks", vm::kMaxMessageAcks));
static_assert(Highest<deploy_piece_t, program_fragment_t>("image_size", vm::kMaxPackageBytes));
static_assert(Highest<deploy_piece_t, program_fragment_t>("offset", vm::kMaxPackageBytes));
static_assert(Highest<program_news_t>("want_offset", vm::kMaxPackageBytes));
static_assert(Highest<program_fragment_t>("size", vm::kFragmentBytes));
static_assert(Highest<deploy_piece_t>("size", kMaxDeployPiece));

// Numbers that the .lcm file itself names.
static_assert(Highest<sim_clock_t>("phase", sim_clock_t::PHASE_END));
static_assert(Highest<joint_command_t>("mode", joint_command_t::MODE_VELOCITY));
static_assert(Highest<label_t>("kind", label_t::KIND_LINK));

// How much a message holds.
static_assert(Highest<header_t>("sequence", kMostSequence));
static_assert(Highest<info_part_t>("total_bytes", kMaxInfoBytes));
static_assert(Highest<health_t>("num_lateness", kMostLateness));
static_assert(Highest<health_t>("num_totals", kMostTopicTotals));
static_assert(Highest<health_t>("num_unauthentic_channels", kMostUnauthenticChannels));
static_assert(Highest<totals_t>("num_totals", kMostTotals));

// Texts.
static_assert(Highest<hello_t, totals_t, leave_t, health_t>("process", kMaxProcessName));
static_assert(Highest<admit_t, lateness_t>("module_name", kMaxProcessName));
static_assert(Highest<module_sensors_t>("name", kMaxProcessName));
static_assert(Highest<resend_t>("sender", kMaxProcessName));
static_assert(Highest<replay_follow_t>("follower", kMaxProcessName));
static_assert(Highest<resend_t, channel_total_t>("channel", kMaxChannelName));
static_assert(Highest<channel_count_t>("channel", kMaxLocalChannel));
static_assert(Highest<topic_total_t>("topic", kMaxTopicName));
static_assert(Highest<log_end_t>("run", kMaxRunName));
static_assert(Highest<log_end_t>("reason", kLongestText));
static_assert(Highest<verdict_t>("error", kLongestText));
static_assert(Highest<hello_t>("build", kLongestText));
static_assert(Highest<control_t>("kind", control_t::KIND_SET));
static_assert(Highest<control_t>("module_name", kLongestText));
static_assert(Highest<control_t>("program_path", kLongestText));
static_assert(Highest<control_answer_t>("state", control_answer_t::STATE_OVERTAKEN));
static_assert(Highest<control_answer_t>("reason", kLongestText));
static_assert(Highest<control_answer_t>("command", kLongestText));
static_assert(Highest<health_t>("first_refused", kLongestText));
static_assert(Highest<sim_clock_t>("end_reason", kLongestText));
static_assert(Highest<value_t>("value_text", kMaxValueText));
static_assert(kMaxStatusName <= 64 && Highest<status_t>("type_name", 64));

}  // namespace
}  // namespace morphbus::bridge
