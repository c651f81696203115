#include "bridge/wire/vm_codec.h"

#include <algorithm>

#include "bridge/wire/codec.h"
#include "bridge/wire/wire_size.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

// The VM shares out the tail of its message by these sizes; the wire's must not be larger.
static_assert(vm::kBodyEntryWireBytes >= LargestSize<morphbus::body_entry_t>());
static_assert(vm::kInvocationWireBytes >= LargestSize<morphbus::invocation_t>());
static_assert(vm::kAckWireBytes >= LargestSize<morphbus::invocation_ack_t>());
static_assert(vm::kFragmentWireBytes >= LargestSize<morphbus::program_fragment_t>());
static_assert(SizeWithoutArrays<morphbus::transform_t>() +
                      vm::kMaxLinks * LargestSize<morphbus::pose_t>() +
                      vm::kMaxNeighbours * LargestSize<morphbus::docked_link_t>() +
                      vm::kMessageTailBytes <=
                  kMaxPayloadBytes,
              "the VM's limits overfill a datagram");

/// Ticks of body entries travel in 32 bits: over a year of ticks of 20 ms; beyond that they stay at
/// the end of the range.
int32_t ToWireStamp(int64_t tick) {
  return static_cast<int32_t>(std::clamp<int64_t>(tick, INT32_MIN, INT32_MAX));
}

/// Quaternions are w x y z on both sides.
void ToWirePose(const vm::PoseF& X, morphbus::pose_t* out) {
  const float position[] = {X.p.x, X.p.y, X.p.z};
  const float orientation[] = {X.q.w, X.q.x, X.q.y, X.q.z};
  std::copy(std::begin(position), std::end(position), out->position_m);
  std::copy(std::begin(orientation), std::end(orientation), out->orientation_wxyz);
}

/// The reverse of ToWirePose.
void FromWirePose(const morphbus::pose_t& pose, vm::PoseF* out) {
  out->p = {pose.position_m[0], pose.position_m[1], pose.position_m[2]};
  out->q = {pose.orientation_wxyz[0], pose.orientation_wxyz[1], pose.orientation_wxyz[2],
            pose.orientation_wxyz[3]};
}

/// Invocations and acknowledgements of a neighbour message.
void InvocationsToWire(const vm::NeighbourMessage& message, morphbus::transform_t* out) {
  out->num_invocations = static_cast<int8_t>(message.num_invocations);
  out->invocations.resize(message.num_invocations);
  for (size_t i = 0; i < message.num_invocations; ++i) {
    const vm::Invocation& from = message.invocations[i];
    morphbus::invocation_t& to = out->invocations[i];
    to.origin_module = static_cast<int16_t>(from.origin);
    to.role = static_cast<int16_t>(from.role);
    to.command = static_cast<int8_t>(from.command);
    to.num_arguments = static_cast<int8_t>(from.num_arguments);
    to.origin_incarnation = static_cast<int32_t>(from.origin_incarnation);
    to.id = static_cast<int32_t>(from.id);
    to.program_hash = static_cast<int64_t>(from.program_hash);
    // Arguments travel as the 32 bits of their cells; the program knows which are numbers.
    to.arguments.clear();
    for (int a = 0; a < from.num_arguments; ++a) to.arguments.push_back(from.arguments[a].AsInt());
  }
  // Up to which invocation of each origin the sender has an unbroken row.
  out->num_acks = static_cast<int8_t>(message.num_acks);
  out->acks.resize(message.num_acks);
  for (size_t i = 0; i < message.num_acks; ++i) {
    const vm::InvocationAck& from = message.acks[i];
    out->acks[i].origin_module = static_cast<int16_t>(from.origin);
    out->acks[i].origin_incarnation = static_cast<int32_t>(from.origin_incarnation);
    out->acks[i].id = static_cast<int32_t>(from.id);
    out->acks[i].floor = static_cast<int32_t>(from.floor);
  }
}

/// The reverse. Decode has seen to it that the counts fit the VM's arrays.
void InvocationsFromWire(const morphbus::transform_t& message, vm::NeighbourMessage* out) {
  out->num_invocations = static_cast<uint8_t>(message.num_invocations);
  for (size_t i = 0; i < out->num_invocations; ++i) {
    const morphbus::invocation_t& from = message.invocations[i];
    vm::Invocation& to = out->invocations[i];
    to.origin = static_cast<uint16_t>(from.origin_module);
    to.origin_incarnation = static_cast<uint32_t>(from.origin_incarnation);
    to.id = static_cast<uint32_t>(from.id);
    to.program_hash = static_cast<uint64_t>(from.program_hash);
    to.role = static_cast<uint16_t>(from.role);
    to.command = static_cast<uint8_t>(from.command);
    to.num_arguments = static_cast<uint8_t>(from.num_arguments);
    for (size_t a = 0; a < to.num_arguments; ++a)
      to.arguments[a] = vm::Cell::Int(from.arguments[a]);
  }
  out->num_acks = static_cast<uint8_t>(message.num_acks);
  for (size_t i = 0; i < out->num_acks; ++i) {
    const morphbus::invocation_ack_t& from = message.acks[i];
    out->acks[i].origin = static_cast<uint16_t>(from.origin_module);
    out->acks[i].origin_incarnation = static_cast<uint32_t>(from.origin_incarnation);
    out->acks[i].id = static_cast<uint32_t>(from.id);
    out->acks[i].floor = static_cast<uint32_t>(from.floor);
  }
}

/// What program the sender runs and wants, and a piece of its own for those who ask.
void ProgramToWire(const vm::NeighbourMessage& message, morphbus::transform_t* out) {
  out->news.version = static_cast<int32_t>(message.news.version);
  out->news.hash = static_cast<int64_t>(message.news.hash);
  out->news.want_version = static_cast<int32_t>(message.news.want_version);
  out->news.want_hash = static_cast<int64_t>(message.news.want_hash);
  out->news.want_offset = static_cast<int32_t>(message.news.want_offset);
  const vm::ProgramFragment& from = message.fragment;
  out->num_fragments = from.size > 0 ? 1 : 0;
  out->fragments.resize(static_cast<size_t>(out->num_fragments));
  if (from.size == 0) return;
  morphbus::program_fragment_t& to = out->fragments[0];
  // The piece says which image it is of and where it belongs, so any mate can use it.
  to.version = static_cast<int32_t>(from.version);
  to.hash = static_cast<int64_t>(from.hash);
  to.image_size = static_cast<int32_t>(from.image_size);
  to.offset = static_cast<int32_t>(from.offset);
  to.size = static_cast<int16_t>(from.size);
  to.bytes.assign(from.bytes, from.bytes + from.size);
}

/// The reverse; without a fragment the VM's one stays empty.
void ProgramFromWire(const morphbus::transform_t& message, vm::NeighbourMessage* out) {
  out->news.version = static_cast<uint32_t>(message.news.version);
  out->news.hash = static_cast<uint64_t>(message.news.hash);
  out->news.want_version = static_cast<uint32_t>(message.news.want_version);
  out->news.want_hash = static_cast<uint64_t>(message.news.want_hash);
  out->news.want_offset = static_cast<uint32_t>(message.news.want_offset);
  if (message.num_fragments == 0) return;
  const morphbus::program_fragment_t& from = message.fragments[0];
  vm::ProgramFragment& to = out->fragment;
  to.version = static_cast<uint32_t>(from.version);
  to.hash = static_cast<uint64_t>(from.hash);
  to.image_size = static_cast<uint32_t>(from.image_size);
  to.offset = static_cast<uint32_t>(from.offset);
  to.size = static_cast<uint16_t>(from.size);
  std::copy(from.bytes.begin(), from.bytes.end(), to.bytes);
}

/// Names longer than the message has room for.
std::string Cut(const std::string& name) { return CutText(name, kMaxStatusName); }

/// An item of a list, or something else where the list is shorter than the report.
template <class T>
T ItemOr(const std::vector<T>& items, size_t i, const T& otherwise) {
  return i < items.size() ? items[i] : otherwise;
}

/// A fault as numbers; whoever shows it looks the names up in the images.
morphbus::fault_t ToFault(const vm::Fault& fault) {
  morphbus::fault_t out;
  // Indices into the program's and the type's tables; -1 where the fault concerns none.
  out.code = static_cast<int16_t>(fault.code);
  out.role = fault.role;
  out.rival_role = fault.rival_role;
  out.function_index = fault.function;
  out.line = static_cast<int16_t>(std::min<int>(fault.line, INT16_MAX));
  out.keyword = fault.keyword;
  out.joint = fault.joint;
  out.link = fault.link;
  out.connector = fault.connector;
  out.asked_axis = static_cast<int8_t>(fault.asked_axis);
  // What a program asked for may be anything; the wire carries finite numbers only.
  const auto finite = [](float v) {
    constexpr float kLargest = 3.4e38F;
    return v == v ? std::clamp(v, -kLargest, kLargest) : 0.0F;
  };
  out.asked = finite(fault.asked);
  out.measured = finite(fault.measured);
  out.limit = finite(fault.limit);
  out.direction[0] = finite(fault.direction_R.x);
  out.direction[1] = finite(fault.direction_R.y);
  out.direction[2] = finite(fault.direction_R.z);
  return out;
}

/// What every STATUS of a report says: identity, role, labels, conventions.
morphbus::status_t StatusCore(const vm::StatusReport& report, const StatusNames& names,
                              uint16_t module_id, uint32_t incarnation, int num_joints) {
  morphbus::status_t out;
  out.module_id = static_cast<int16_t>(module_id);
  out.type_name = Cut(names.type_name);
  out.incarnation = static_cast<int32_t>(incarnation);
  // What the module plays, and whether it knows where it is.
  out.role = report.role;
  out.role_name = Cut(names.role_name);
  out.frozen = report.frozen ? 1 : 0;
  out.has_pose = report.has_pose ? 1 : 0;
  out.pose_stale = report.pose_stale ? 1 : 0;
  // Labels by name, since a listener has no program at hand.
  for (size_t i = 0; i < report.num_labels; ++i) {
    morphbus::label_t label;
    label.name = Cut(ItemOr<std::string>(names.label_names, i, ""));
    const bool joint = i < names.label_is_joint.size() && names.label_is_joint[i];
    label.kind = joint ? morphbus::label_t::KIND_JOINT : morphbus::label_t::KIND_LINK;
    label.index = report.labels[i];
    out.labels.push_back(std::move(label));
  }
  out.num_labels = static_cast<int8_t>(out.labels.size());
  // Conventions are told as signs: +1 or -1 to the actuator's own, 0 without one.
  out.num_joints = static_cast<int8_t>(num_joints);
  out.joint_sign.assign(report.signs, report.signs + num_joints);
  out.num_tasks = out.num_faults = out.tasks_omitted = 0;
  out.faults_dropped = static_cast<int16_t>(std::min<int>(report.faults_dropped, INT16_MAX));
  return out;
}

/// Bytes left in the datagram.
size_t RoomIn(const morphbus::status_t& status) {
  const auto size = static_cast<size_t>(status.getEncodedSize());
  return size < kMaxPayloadBytes ? kMaxPayloadBytes - size : 0;
}

/// Adds the tasks that fit, and counts those that do not.
void AddTasks(const vm::StatusReport& report, const StatusNames& names, morphbus::status_t* out) {
  for (size_t i = 0; i < report.num_tasks; ++i) {
    morphbus::task_t task;
    task.kind = static_cast<int8_t>(report.tasks[i].kind);
    task.function_name = Cut(ItemOr<std::string>(names.task_functions, i, ""));
    task.line = static_cast<int16_t>(std::min<int>(report.tasks[i].line, INT16_MAX));
    // A later task with a shorter name may still fit.
    if (static_cast<size_t>(task._getEncodedSizeNoHash()) > RoomIn(*out)) {
      ++out->tasks_omitted;
      continue;
    }
    out->tasks.push_back(std::move(task));
    ++out->num_tasks;
  }
}

}  // namespace

void ToTransform(const vm::NeighbourMessage& message, morphbus::transform_t* out) {
  // Who speaks, what role it plays, and whose broadcast its poses rest on.
  out->module_id = static_cast<int16_t>(message.sender);
  out->incarnation = static_cast<int32_t>(message.incarnation);
  out->role = message.role;
  out->has_pose = message.has_pose ? 1 : 0;
  out->pose_stale = message.pose_stale ? 1 : 0;
  out->root_module = static_cast<int16_t>(message.root);
  out->root_incarnation = static_cast<int32_t>(message.root_incarnation);
  out->root_sequence = message.root_sequence;
  out->hops = static_cast<int16_t>(message.hops);
  // Where the sender's links are, and what is docked to them.
  out->num_links = static_cast<int8_t>(message.num_links);
  out->link_poses.resize(message.num_links);
  for (size_t i = 0; i < message.num_links; ++i) ToWirePose(message.X_RL[i], &out->link_poses[i]);
  out->num_docked = static_cast<int8_t>(message.num_docked);
  out->docked.resize(message.num_docked);
  for (size_t i = 0; i < message.num_docked; ++i) {
    out->docked[i].connector = static_cast<int8_t>(message.docked[i].connector);
    out->docked[i].link = static_cast<int8_t>(message.docked[i].link);
    out->docked[i].body_link = static_cast<int8_t>(message.docked[i].body_link);
    out->docked[i].mate_module = static_cast<int16_t>(message.docked[i].mate_module);
  }
  // The turn of the bodies' joints, a few at a time.
  out->body_turns = static_cast<int8_t>(message.body_turns);
  out->num_body_entries = static_cast<int8_t>(message.num_body_entries);
  out->body_entries.resize(message.num_body_entries);
  for (size_t i = 0; i < message.num_body_entries; ++i) {
    const vm::BodyEntry& entry = message.body_entries[i];
    out->body_entries[i].link = static_cast<int8_t>(entry.link);
    out->body_entries[i].joint = static_cast<int8_t>(entry.joint);
    out->body_entries[i].module_id = static_cast<int16_t>(entry.module);
    out->body_entries[i].stamp_tick = ToWireStamp(entry.stamp);
  }
  // The rest of the tail: commands for others, and programs.
  InvocationsToWire(message, out);
  ProgramToWire(message, out);
}

void FromTransform(const morphbus::transform_t& message, vm::NeighbourMessage* out) {
  // Whatever the message does not mention is as in a fresh struct.
  *out = vm::NeighbourMessage();
  out->sender = static_cast<uint16_t>(message.module_id);
  out->incarnation = static_cast<uint32_t>(message.incarnation);
  out->tick = message.header.tick;
  out->program_hash = static_cast<uint64_t>(message.header.program_hash);
  out->role = message.role;
  out->has_pose = message.has_pose != 0;
  out->pose_stale = message.pose_stale != 0;
  out->root = static_cast<uint16_t>(message.root_module);
  out->root_incarnation = static_cast<uint32_t>(message.root_incarnation);
  out->root_sequence = message.root_sequence;
  out->hops = static_cast<uint16_t>(message.hops);
  // The sender's links in the robot frame, and what is docked to them.
  out->num_links = static_cast<uint8_t>(message.num_links);
  for (size_t i = 0; i < out->num_links; ++i) FromWirePose(message.link_poses[i], &out->X_RL[i]);
  out->num_docked = static_cast<uint8_t>(message.num_docked);
  for (size_t i = 0; i < out->num_docked; ++i) {
    out->docked[i] = {static_cast<uint8_t>(message.docked[i].connector),
                      static_cast<uint8_t>(message.docked[i].link),
                      static_cast<uint8_t>(message.docked[i].body_link),
                      static_cast<uint16_t>(message.docked[i].mate_module)};
  }
  // Its share of news about joints that touch bodies.
  out->body_turns = static_cast<uint8_t>(message.body_turns);
  out->num_body_entries = static_cast<uint8_t>(message.num_body_entries);
  for (size_t i = 0; i < out->num_body_entries; ++i) {
    const morphbus::body_entry_t& entry = message.body_entries[i];
    out->body_entries[i] = {static_cast<uint8_t>(entry.link), static_cast<uint8_t>(entry.joint),
                            static_cast<uint16_t>(entry.module_id), entry.stamp_tick};
  }
  InvocationsFromWire(message, out);
  ProgramFromWire(message, out);
}

void ToActuator(const vm::TickOutput& output, uint16_t module_id, int num_joints,
                int64_t status_count, morphbus::actuator_t* out) {
  static_assert(
      static_cast<int8_t>(vm::ActuatorMode::kHold) == morphbus::joint_command_t::MODE_HOLD &&
      static_cast<int8_t>(vm::ActuatorMode::kVelocity) == morphbus::joint_command_t::MODE_VELOCITY);
  out->module_id = static_cast<int16_t>(module_id);
  out->status_count = status_count;
  out->num_joints = static_cast<int8_t>(num_joints);
  // Every joint has a command in every tick, in the actuator's own sign.
  out->joints.resize(static_cast<size_t>(num_joints));
  for (int i = 0; i < num_joints; ++i) {
    morphbus::joint_command_t& joint = out->joints[i];
    joint.mode = static_cast<int8_t>(output.joints[i].mode);
    joint.target_si = output.joints[i].target;
    joint.speed_si = output.joints[i].speed;
  }
  // Commands to connectors are few and are told one by one.
  out->num_connectors = static_cast<int8_t>(output.num_connector_commands);
  out->connectors.resize(output.num_connector_commands);
  for (size_t i = 0; i < output.num_connector_commands; ++i) {
    const vm::ConnectorCommand& command = output.connector_commands[i];
    out->connectors[i].connector = static_cast<int8_t>(command.connector);
    out->connectors[i].state = static_cast<int8_t>(command.state);
    out->connectors[i].value = static_cast<int8_t>(command.value);
  }
}

Result<void> FromSensors(const morphbus::module_sensors_t& reading, int num_joints,
                         int num_connectors, vm::TickInput* out) {
  // A reading of another module type cannot be used.
  if (reading.num_joints != num_joints) {
    return Fail(reading.name + " senses " + std::to_string(reading.num_joints) +
                " joints, its type has " + std::to_string(num_joints));
  }
  for (int i = 0; i < num_joints; ++i) {
    out->joint_position[i] = reading.joint_position_si[i];
    out->joint_velocity[i] = static_cast<double>(reading.joint_velocity_si[i]);
  }
  // Nothing is docked but what the reading lists.
  for (vm::ConnectorReading& connector : out->connectors) connector = vm::ConnectorReading();
  for (const morphbus::docked_connector_t& docked : reading.docked) {
    if (docked.connector >= num_connectors || out->connectors[docked.connector].docked) {
      return Fail(reading.name + " senses something at connector " +
                  std::to_string(docked.connector) + ", which its type does not have, or twice");
    }
    vm::ConnectorReading& connector = out->connectors[docked.connector];
    // Who is there, with which connector, and in which connection of the model.
    connector.docked = true;
    connector.mate_module = static_cast<uint16_t>(docked.mate_module);
    connector.mate_connector = static_cast<uint8_t>(docked.mate_connector);
    connector.connection_type = static_cast<uint8_t>(docked.connection_type);
    connector.number = static_cast<uint16_t>(docked.number);
  }
  return {};
}

std::vector<morphbus::status_t> ToStatus(const vm::StatusReport& report, const StatusNames& names,
                                         uint16_t module_id, uint32_t incarnation, int num_joints) {
  std::vector<morphbus::status_t> messages;
  size_t fault = 0;
  // As many messages as the faults need; each says the rest again, so that any one can be read
  // alone.
  do {
    morphbus::status_t& message =
        messages.emplace_back(StatusCore(report, names, module_id, incarnation, num_joints));
    // Counted once.
    if (messages.size() > 1) message.faults_dropped = 0;
    while (fault < report.num_faults) {
      // As many faults as fit; the next message takes the rest.
      morphbus::fault_t one = ToFault(report.faults[fault]);
      if (static_cast<size_t>(one._getEncodedSizeNoHash()) > RoomIn(message)) break;
      message.faults.push_back(std::move(one));
      ++message.num_faults;
      ++fault;
    }
    // Tasks get the room that the faults leave.
    AddTasks(report, names, &message);
    MORPHBUS_CHECK(fault >= report.num_faults || message.num_faults > 0);
  } while (fault < report.num_faults);
  return messages;
}

vm::Fault FromFault(const morphbus::fault_t& fault) {
  vm::Fault out;
  out.code = static_cast<vm::FaultCode>(fault.code);
  out.role = fault.role;
  out.rival_role = fault.rival_role;
  out.function = fault.function_index;
  out.line = static_cast<uint16_t>(fault.line);
  out.keyword = fault.keyword;
  out.joint = fault.joint;
  out.link = fault.link;
  out.connector = fault.connector;
  out.asked_axis = static_cast<vm::Axis>(fault.asked_axis);
  out.asked = fault.asked;
  out.measured = fault.measured;
  out.limit = fault.limit;
  out.direction_R = {fault.direction[0], fault.direction[1], fault.direction[2]};
  return out;
}

void ToRequest(const vm::InvokeRequest& request, uint16_t module_id,
               morphbus::invoke_request_t* out) {
  out->module_id = static_cast<int16_t>(module_id);
  out->role = static_cast<int16_t>(request.role);
  out->command = static_cast<int8_t>(request.command);
  out->num_arguments = static_cast<int8_t>(request.num_arguments);
  out->program_hash = static_cast<int64_t>(request.program_hash);
  out->arguments.clear();
  for (int i = 0; i < request.num_arguments; ++i) {
    out->arguments.push_back(request.arguments[i].AsInt());
  }
}

void FromRequest(const morphbus::invoke_request_t& request, vm::InvokeRequest* out) {
  out->program_hash = static_cast<uint64_t>(request.program_hash);
  out->role = static_cast<uint16_t>(request.role);
  out->command = static_cast<uint8_t>(request.command);
  out->num_arguments = static_cast<uint8_t>(request.num_arguments);
  for (size_t i = 0; i < out->num_arguments; ++i) {
    out->arguments[i] = vm::Cell::Int(request.arguments[i]);
  }
}

std::vector<std::vector<size_t>> SplitSensors(
    const std::vector<morphbus::module_sensors_t>& modules, const std::vector<int>& most_docked) {
  // What a part takes without modules, and with all the orders it can carry.
  constexpr size_t kEmpty = SizeWithoutArrays<morphbus::sensors_t>() +
                            vm::kMaxRequests * LargestSize<morphbus::invoke_request_t>() +
                            LargestSize<morphbus::deploy_piece_t>();
  std::vector<std::vector<size_t>> parts(1);
  size_t size = kEmpty;
  for (size_t i = 0; i < modules.size(); ++i) {
    // The reading with something docked at every connector.
    morphbus::module_sensors_t most = modules[i];
    most.docked.resize(std::min(most_docked[i], vm::kMaxNeighbours));
    most.num_docked = static_cast<int8_t>(most.docked.size());
    const auto bytes = static_cast<size_t>(most._getEncodedSizeNoHash());
    // A module that might not fit any more begins the next part.
    if (!parts.back().empty() && size + bytes > kMaxPayloadBytes) {
      parts.emplace_back();
      size = kEmpty;
    }
    parts.back().push_back(i);
    size += bytes;
  }
  return parts;
}

size_t WorldBodiesPerPart() {
  // A pose has a fixed size, so division tells.
  return (kMaxPayloadBytes - SizeWithoutArrays<morphbus::world_t>()) /
         LargestSize<morphbus::body_pose_t>();
}

}  // namespace morphbus::bridge
