#pragma once
// The layout of every message, field by field in the order of its .lcm file: what a receiver may
// believe, and thereby how large a message can get. One description serves every visitor, which
// says what a field means to it: WireReader (bridge/wire/wire_reader.h) checks bytes, WireSizer
// (bridge/wire/wire_size.h) adds sizes up.
//
// A new field of a message needs a line in its .lcm file, one here (for what only the parties of a
// run tell each other in bridge/wire/lockstep_layout.h, for inspection_t and its parts in
// bridge/wire/held_layout.h), and one in each direction in bridge/wire/vm_codec.cc if the VM is to
// know it; test/bridge/layout_test.cc fails where the first two disagree. The names given here are
// those of the .lcm file, since failures quote them.
//
// A visitor offers:
//   Int8, Int16, Int32, Int64(name, lowest, highest)   a number in that range; returns it
//   Count8, Count16, Count32(name, highest)            the length of an array; returns it
//   Bool(name), Hash(name)                             0 or 1; 64 bits without a meaning
//   Floats, Doubles(name, count)                       finite numbers
//   FloatQuaternion, DoubleQuaternion(name)            w x y z, of about unit length
//   Bytes(name, count)                                 anything
//   Text(name, longest), Texts(name, count, longest)   strings of at most so many bytes
//   Struct<M>(name), Structs<M>(name, count)           other messages of this file
//   Refuse(name, why)                                  what two fields together must not say

#include <cstdint>
#include <morphbus/actuator_t.hpp>
#include <morphbus/control_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/wire/channels.h"
#include "bridge/wire/held_layout.h"
#include "bridge/wire/layout_base.h"
#include "bridge/wire/lockstep_layout.h"
#include "bridge/wire/wire_limits.h"
#include "vm/image/fault.h"
#include "vm/limits.h"

namespace morphbus::bridge::layout {

// Parts of messages.

/// What every message begins with.
template <class V>
constexpr void Walk(V& v, As<morphbus::header_t>) {
  // CRC and protocol are covered by the envelope's own check (bridge/wire/codec.h), auth by the bus
  // (bridge/wire/sealed_bus.h).
  v.Int32("crc32", kLeast32, kMost32);
  v.Hash("auth");
  v.Int32("protocol", kLeast32, kMost32);
  // The lockstep counts ticks, times and messages from 0.
  v.Int64("tick", 0, kMost64);
  v.Int64("sim_time_us", 0, kMost64);
  v.Int64("sequence", 0, kMostSequence);
  // Zero stands for "none"; what the receiver expects is compared in bridge/wire/codec.h.
  v.Hash("model_hash");
  v.Hash("program_hash");
}

/// Place and size of a piece of a package, and the piece, of at most `most` bytes. Nothing says
/// that the bytes are a program: the verifier sees to that once the package is whole.
template <class V>
constexpr void WalkPiece(V& v, int64_t most) {
  const int64_t image_size = v.Int32("image_size", 1, vm::kMaxPackageBytes);
  const int64_t offset = v.Int32("offset", 0, vm::kMaxPackageBytes);
  // A piece holds at least one byte and lies within the package, so that collecting always ends.
  const int64_t size = v.Count16("size", most);
  if (size < 1) v.Refuse("size", "is out of range");
  if (offset + size > image_size) v.Refuse("offset", "puts the piece beyond the package's end");
  v.Bytes("bytes", size);
}

/// A connector that is mated. A connection number is counted from 1; 0 would be none.
template <class V>
constexpr void Walk(V& v, As<morphbus::docked_connector_t>) {
  // Ours and the mate's, each by its number in its own module type.
  v.Int8("connector", 0, kLastConnector);
  v.Int8("mate_connector", 0, kLastConnector);
  v.Int16("mate_module", 0, kMost16);
  // The model's connection definitions and connections are not known here: whoever looks one up
  // checks the index.
  v.Int8("connection_type", 0, kMost8);
  v.Int16("number", 1, kMost16);
}

/// Readings of one module. Positions, velocities and efforts have the same length.
template <class V>
constexpr void Walk(V& v, As<morphbus::module_sensors_t>) {
  v.Int16("module_id", 0, kMost16);
  v.Text("name", kMaxProcessName);
  const int64_t joints = v.Count8("num_joints", vm::kMaxJoints);
  // One number for each joint, rad or m, rad/s or m/s, and N m or N.
  v.Doubles("joint_position_si", joints);
  v.Floats("joint_velocity_si", joints);
  v.Floats("joint_effort_si", joints);
  v.Floats("sensor_value", v.Count8("num_sensor_values", vm::kMaxSensorValues));
  // What is docked now; a connector that is not listed is free.
  List8<morphbus::docked_connector_t>(v, "num_docked", "docked", vm::kMaxNeighbours);
}

/// An invocation from outside. Arguments are 32-bit cells, typed by the program: any bits will do,
/// and whoever runs it checks that its own program has that role and command.
template <class V>
constexpr void Walk(V& v, As<morphbus::invoke_request_t>) {
  v.Int16("module_id", 0, kMost16);
  v.Int16("role", 0, vm::kMaxRoles - 1);
  v.Int8("command", 0, vm::kMaxRoutines - 1);
  const int64_t arguments = v.Count8("num_arguments", vm::kMaxArguments);
  // The image under which role and command have these numbers.
  v.Hash("program_hash");
  v.Bytes("arguments", 4 * arguments);
}

/// A piece of a new program from outside, on its way to the module from where it spreads.
template <class V>
constexpr void Walk(V& v, As<morphbus::deploy_piece_t>) {
  v.Int16("module_id", 0, kMost16);
  // Of the whole package, so that pieces of two programs are not mixed.
  v.Hash("hash");
  WalkPiece(v, kMaxDeployPiece);
}

/// A link's true pose in the world frame, X_WL, from the simulator in double precision.
template <class V>
constexpr void Walk(V& v, As<morphbus::body_pose_t>) {
  v.Int16("module_id", 0, kMost16);
  v.Int8("link", 0, kLastLink);
  // Metres in W, and the turn from W to the link.
  v.Doubles("position_m", 3);
  v.DoubleQuaternion("orientation_wxyz");
}

/// What the ground and obstacles exert on a link, newtons in W.
template <class V>
constexpr void Walk(V& v, As<morphbus::contact_force_t>) {
  v.Int16("module_id", 0, kMost16);
  v.Int8("link", 0, kLastLink);
  v.Floats("force_n", 3);
}

/// A pose as modules tell it, X_RL in the robot frame, in single precision.
template <class V>
constexpr void Walk(V& v, As<morphbus::pose_t>) {
  // Metres in R, and the turn from R to the link.
  v.Floats("position_m", 3);
  v.FloatQuaternion("orientation_wxyz");
}

/// Where the root's sensor sees it. Whoever uses it checks that it is of the root's own link.
template <class V>
constexpr void Walk(V& v, As<morphbus::root_pose_t>) {
  v.Int16("module_id", 0, kMost16);
  v.Int8("link", 0, kLastLink);
  v.template Struct<morphbus::pose_t>("pose");
}

/// A connector of the sender that something is mated to, and the sender's link that carries it.
template <class V>
constexpr void Walk(V& v, As<morphbus::docked_link_t>) {
  v.Int8("connector", 0, kLastConnector);
  // The link that carries it, and the lowest of those that are rigidly one with that link.
  v.Int8("link", 0, kLastLink);
  v.Int8("body_link", 0, kLastLink);
  v.Int16("mate_module", 0, kMost16);
}

/// News that a joint touches the body of one of the sender's links. Stamps may lie before the run.
template <class V>
constexpr void Walk(V& v, As<morphbus::body_entry_t>) {
  // The link is one of the sender's, the joint one of the module named below it.
  v.Int8("link", 0, kLastLink);
  v.Int8("joint", 0, kLastJoint);
  v.Int16("module_id", 0, kMost16);
  // The tick in which that module said so.
  v.Int32("stamp_tick", kLeast32, kMost32);
}

/// A command on its way through the robot. Ids count from 1, and 0 is an id that was never given.
template <class V>
constexpr void Walk(V& v, As<morphbus::invocation_t>) {
  // Who issued it. With the incarnation and the id below this names the invocation.
  v.Int16("origin_module", 0, kMost16);
  v.Int16("target_module", -1, kMost16);
  v.Int16("role", 0, vm::kMaxRoles - 1);
  v.Int8("command", 0, vm::kMaxRoutines - 1);
  const int64_t arguments = v.Count8("num_arguments", vm::kMaxArguments);
  v.Int32("origin_incarnation", 0, kMost32);
  v.Int32("id", 1, kMost32);
  // It runs under this image alone.
  v.Hash("program_hash");
  v.Bytes("arguments", 4 * arguments);
}

/// Which invocations of a module the sender has. Here an id of 0 says that nothing has come yet.
template <class V>
constexpr void Walk(V& v, As<morphbus::invocation_ack_t>) {
  v.Int16("origin_module", 0, kMost16);
  v.Int32("origin_incarnation", 0, kMost32);
  // All up to `id` have come; those from `floor` on are still kept for others.
  v.Int32("id", 0, kMost32);
  v.Int32("floor", 0, kMost32);
}

/// Which program the sender runs and which it collects. Wanting nothing is a version of 0.
template <class V>
constexpr void Walk(V& v, As<morphbus::program_news_t>) {
  // The newest that is whole: the highest version spreads, and of equal ones that with the higher
  // id.
  v.Int32("version", 0, kMost32);
  v.Hash("hash");
  // What is collected, and the first byte of it that is missing.
  v.Int32("want_version", 0, kMost32);
  v.Hash("want_hash");
  v.Int32("want_offset", 0, vm::kMaxPackageBytes);
}

/// A piece of a program on its way from module to module.
template <class V>
constexpr void Walk(V& v, As<morphbus::program_fragment_t>) {
  v.Int32("version", 0, kMost32);
  v.Hash("hash");
  WalkPiece(v, vm::kFragmentBytes);
}

/// What a joint shall do. Targets and speeds may have any sign and size; the servo limits them.
template <class V>
constexpr void Walk(V& v, As<morphbus::joint_command_t>) {
  v.Int8("mode", morphbus::joint_command_t::MODE_HOLD, morphbus::joint_command_t::MODE_VELOCITY);
  // Radians or metres, and those a second, in the actuator's own sign.
  v.Doubles("target_si", 1);
  v.Doubles("speed_si", 1);
}

/// Sets a state variable of a connector. Values are indices into what the variable allows.
template <class V>
constexpr void Walk(V& v, As<morphbus::connector_command_t>) {
  // The connector by its number in the type, the state by its number in the connector.
  v.Int8("connector", 0, kLastConnector);
  v.Int8("state", 0, vm::kMaxConnectorStates - 1);
  v.Int8("value", 0, kMost8);
}

/// What a name of the role means in this module. A label that does not resolve has index -1.
template <class V>
constexpr void Walk(V& v, As<morphbus::label_t>) {
  v.Text("name", kNameText);
  v.Int8("kind", morphbus::label_t::KIND_JOINT, morphbus::label_t::KIND_LINK);
  // Of a joint or a link, as the kind says.
  v.Int8("index", -1, kLastJoint > kLastLink ? kLastJoint : kLastLink);
}

/// The kinds of task have the VM's numbers.
inline constexpr int64_t kLastTaskKind = static_cast<int64_t>(vm::TaskKind::kHandler);

/// What a module is running. The kinds are startup, behavior, command and handler, from 0.
template <class V>
constexpr void Walk(V& v, As<morphbus::task_t>) {
  v.Int8("kind", 0, kLastTaskKind);
  v.Text("function_name", kNameText);
  v.Int16("line", 0, kMost16);
}

/// Something that went wrong, as numbers. Every index is -1 where the fault concerns nothing of the
/// kind; a line of 0 is unknown.
template <class V>
constexpr void Walk(V& v, As<morphbus::fault_t>) {
  // What happened, and where in the program.
  v.Int16("code", 0, vm::kNumFaultCodes - 1);
  v.Int16("role", -1, vm::kMaxRoles - 1);
  v.Int16("rival_role", -1, vm::kMaxRoles - 1);
  v.Int16("function_index", -1, vm::kMaxFunctions - 1);
  v.Int16("line", 0, kMost16);
  v.Int16("keyword", -1, vm::kMaxKeywords - 1);
  // Parts of the module, by their numbers in its type.
  v.Int8("joint", -1, kLastJoint);
  v.Int8("link", -1, kLastLink);
  v.Int8("connector", -1, kLastConnector);
  v.Int8("asked_axis", 0, vm::kNumAxes - 1);
  // The task that it has ended.
  v.Int8("ended_task", -1, kLastTaskKind);
  v.Int16("task_function", -1, vm::kMaxFunctions - 1);
  // In degrees or as the kind of fault says. Direction is a unit vector in R, or zero.
  v.Floats("asked", 1);
  v.Floats("measured", 1);
  v.Floats("limit", 1);
  v.Floats("direction", 3);
}

/// A line that a program printed. The text is a constant of an image that is not known here;
/// whoever shows it looks it up.
template <class V>
constexpr void Walk(V& v, As<morphbus::print_t>) {
  v.Int16("function_index", -1, vm::kMaxFunctions - 1);
  v.Int16("line", 0, kMost16);
  v.Int16("text", 0, kMost16);
  v.Bytes("values", 4 * v.Count8("num_values", vm::kMaxPrintValues));
}

// Messages.

/// CLOCK (sim_clock_t). In the last one, with PHASE_END, the header's tick is the one after the
/// last, for which there are no sensors.
template <class V>
constexpr void Walk(V& v, As<morphbus::sim_clock_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Int8("phase", morphbus::sim_clock_t::PHASE_START, morphbus::sim_clock_t::PHASE_END);
  // Length of a tick of sim time, the same all the time.
  v.Int32("tick_us", 1, kMost32);
  v.Int16("num_modules", 0, kMost16);
  // Listeners learn here how many messages a tick has on SENSORS and on WORLD.
  v.Int16("num_sensors_parts", 0, kMost16);
  v.Int16("num_world_parts", 0, kMost16);
  // For people; empty but in the last CLOCK.
  v.Text("end_reason", kLongestText);
  // What people asked for that takes effect at this tick, as text.
  const int64_t controls = v.Count16("num_controls", kMostControls);
  v.Texts("controls", controls, kLongestText);
}

/// SENSORS (sensors_t), one part of several. How many modules fit is bounded by the datagram.
template <class V>
constexpr void Walk(V& v, As<morphbus::sensors_t>) {
  v.template Struct<morphbus::header_t>("header");
  WalkPart(v);
  List16<morphbus::module_sensors_t>(v, "num_modules", "modules", kMost16);
  List8<morphbus::invoke_request_t>(v, "num_requests", "requests", vm::kMaxRequests);
  // Orders for modules of this part.
  List8<morphbus::deploy_piece_t>(v, "num_pieces", "pieces", 1);
  List8<morphbus::root_pose_t>(v, "num_root_poses", "root_poses", 1);
  const int64_t inspected = v.Count8("num_inspected", kMost8);
  for (int64_t i = 0; i < inspected; ++i) v.Int16("inspected", 0, kMost16);
}

/// WORLD (world_t), one part of several; it may be empty.
template <class V>
constexpr void Walk(V& v, As<morphbus::world_t>) {
  v.template Struct<morphbus::header_t>("header");
  WalkPart(v);
  List16<morphbus::body_pose_t>(v, "num_bodies", "bodies", kMost16);
  // Only of links that are touched.
  List16<morphbus::contact_force_t>(v, "num_contacts", "contacts", kMost16);
}

/// TRANSFORM (transform_t). The counts keep every tail within a datagram, as vm/limits.h shares it
/// out.
template <class V>
constexpr void Walk(V& v, As<morphbus::transform_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Int16("module_id", 0, kMost16);
  v.Int32("incarnation", 0, kMost32);
  v.Int16("role", -1, vm::kMaxRoles - 1);
  // Cells that the program types; who reads one checks that it is a value of its type.
  v.Bytes("shared", 4 * v.Count8("num_shared", vm::kMaxSharedFields));
  v.Bool("has_pose");
  v.Bool("pose_stale");
  // Whose broadcast its poses rest on, and how many modules lie between.
  v.Int16("root_module", 0, kMost16);
  v.Int32("root_incarnation", 0, kMost32);
  v.Int64("root_sequence", kLeast64, kMost64);
  v.Int16("hops", 0, kMost16);
  // Where its links are in R, in the order of their declaration, and who is docked to it.
  List8<morphbus::pose_t>(v, "num_links", "link_poses", vm::kMaxLinks);
  List8<morphbus::docked_link_t>(v, "num_docked", "docked", vm::kMaxNeighbours);
  // The tail: what has no room in this message waits for a later one.
  v.Int8("body_turns", 1, kMost8);
  List8<morphbus::body_entry_t>(v, "num_body_entries", "body_entries", vm::kMaxMessageBodyEntries);
  List8<morphbus::invocation_t>(v, "num_invocations", "invocations", vm::kMaxMessageInvocations);
  List8<morphbus::invocation_ack_t>(v, "num_acks", "acks", vm::kMaxMessageAcks);
  // Programs spread from neighbour to neighbour, a piece a message.
  v.template Struct<morphbus::program_news_t>("news");
  List8<morphbus::program_fragment_t>(v, "num_fragments", "fragments", 1);
}

/// ACTUATOR (actuator_t): the commands of one module and tick.
template <class V>
constexpr void Walk(V& v, As<morphbus::actuator_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Int16("module_id", 0, kMost16);
  // STATUS messages so far, so that the logger notices when one is missing.
  v.Int64("status_count", 0, kMost64);
  // A command for each joint; connectors are named, as few change at a time.
  List8<morphbus::joint_command_t>(v, "num_joints", "joints", vm::kMaxJoints);
  List8<morphbus::connector_command_t>(v, "num_connectors", "connectors", vm::kMaxConnectors);
}

/// STATUS (status_t): what a module is and does, for people and tools.
template <class V>
constexpr void Walk(V& v, As<morphbus::status_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Int16("module_id", 0, kMost16);
  v.Text("type_name", kNameText);
  v.Int32("incarnation", 0, kMost32);
  v.Int16("role", -1, vm::kMaxRoles - 1);
  v.Text("role_name", kNameText);
  v.Bool("frozen");
  v.Bool("has_pose");
  v.Bool("pose_stale");
  // What the role's names stand for in this module.
  List8<morphbus::label_t>(v, "num_labels", "labels", vm::kMaxLabels);
  const int64_t joints = v.Count8("num_joints", vm::kMaxJoints);
  // Convention of each joint; 0 for one that has none.
  for (int64_t i = 0; i < joints; ++i) v.Int8("joint_sign", -1, 1);
  List8<morphbus::task_t>(v, "num_tasks", "tasks", vm::kMaxTasks);
  v.Int8("tasks_omitted", 0, kMost8);
  v.Int8("ended_behaviors", 0, vm::kMaxRoutines);
  v.Bool("startup_ended");
  // Faults that do not fit come with further STATUS messages of the same tick.
  List8<morphbus::fault_t>(v, "num_faults", "faults", vm::kMaxFaultsPerTick);
  v.Int16("faults_dropped", 0, kMost16);
  List8<morphbus::print_t>(v, "num_prints", "prints", vm::kMaxPrintsPerTick);
  v.Int16("prints_dropped", 0, kMost16);
  // Only where asked.
  List8<morphbus::inspection_t>(v, "num_inspections", "inspections", 1);
}

/// HELLO (hello_t). Whether the process fits the run is decided by the sim, by name, type and
/// hashes.
template <class V>
constexpr void Walk(V& v, As<morphbus::hello_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("process", kMaxProcessName);
  v.Int32("pid", 0, kMost32);
  // A random number, so any value will do.
  v.Hash("claim");
  v.Int32("incarnation", 0, kMost32);
  v.Text("type_name", kNameText);
  v.Hash("kinematics_hash");
  v.Hash("wire_hash");
  v.Hash("arithmetic_hash");
  // For people only.
  v.Text("build", kLongestText);
}

/// INFO (info_part_t). A part is no larger than the whole.
template <class V>
constexpr void Walk(V& v, As<morphbus::info_part_t>) {
  v.template Struct<morphbus::header_t>("header");
  WalkPart(v);
  const int64_t total = v.Int32("total_bytes", 0, kMaxInfoBytes);
  v.Bytes("data", v.Count32("size", total));
}

/// CONTROL (control_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::control_t>) {
  v.template Struct<morphbus::header_t>("header");
  // It grows with every command, so that an old one is not taken again.
  v.Int64("counter", 0, kMost64);
  v.Text("command", kLongestText);
}

/// END (log_end_t). It stands in a file, and so may be larger than a datagram.
template <class V>
constexpr void Walk(V& v, As<morphbus::log_end_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("run", kMaxRunName);
  // Whether it had no key, whether it ended as planned, and why it ended.
  v.Bool("open");
  v.Bool("clean");
  v.Text("reason", kLongestText);
  v.Text("run_hash", kRunHashText);
  v.Int64("num_ticks", 0, kMost64);
  List16<morphbus::channel_total_t>(v, "num_channels", "channels", kMost16);
}

}  // namespace morphbus::bridge::layout
