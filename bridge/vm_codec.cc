#include "bridge/vm_codec.h"

#include <algorithm>

#include "bridge/codec.h"
#include "compiler/source/check.h"

namespace morphbus::bridge {
namespace {

// Sizes on the wire, bytes: a struct's fields add up, nothing is padded.
constexpr size_t kHeaderBytes = 8 + 48;
constexpr size_t kTransformCore = kHeaderBytes + 2 + 4 + 2 + 1 + 1 + 2 + 4 + 8 + 2;
constexpr size_t kTransformCounts = 6;  // Lengths of the arrays, one byte each.
constexpr size_t kNewsBytes = 4 + 8 + 4 + 8 + 4;
constexpr size_t kLargestTransform = kTransformCore + kTransformCounts + vm::kMaxLinks * 28 +
                                     vm::kMaxNeighbours * 5 + 1 + kNewsBytes +
                                     vm::kMessageTailBytes;
static_assert(kLargestTransform <= kMaxPayloadBytes, "the VM's limits overfill a datagram");
// The VM shares out the tail by these sizes; the wire's must not be larger.
static_assert(vm::kBodyEntryWireBytes >= 1 + 1 + 2 + 4);
static_assert(vm::kInvocationWireBytes >= 2 + 2 + 1 + 1 + 4 + 4 + 8 + 4 * vm::kMaxArguments);
static_assert(vm::kAckWireBytes >= 2 + 4 + 4 + 4);
static_assert(vm::kFragmentWireBytes >= 4 + 8 + 4 + 4 + 2 + vm::kFragmentBytes);
constexpr size_t kBodyBytes = 2 + 1 + 3 * 8 + 4 * 8;
constexpr size_t kPartCore = kHeaderBytes + 2 + 2 + 2;

int32_t ToWireStamp(int64_t tick) {
  return static_cast<int32_t>(std::clamp<int64_t>(tick, INT32_MIN, INT32_MAX));
}

void ToWirePose(const vm::PoseF& X, morphbus::pose_t* out) {
  const float position[] = {X.p.x, X.p.y, X.p.z};
  const float orientation[] = {X.q.w, X.q.x, X.q.y, X.q.z};
  std::copy(std::begin(position), std::end(position), out->position_m);
  std::copy(std::begin(orientation), std::end(orientation), out->orientation_wxyz);
}

void FromWirePose(const morphbus::pose_t& pose, vm::PoseF* out) {
  out->p = {pose.position_m[0], pose.position_m[1], pose.position_m[2]};
  out->q = {pose.orientation_wxyz[0], pose.orientation_wxyz[1], pose.orientation_wxyz[2],
            pose.orientation_wxyz[3]};
}

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
    to.arguments.clear();
    for (int a = 0; a < from.num_arguments; ++a) to.arguments.push_back(from.arguments[a].AsInt());
  }
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
  to.version = static_cast<int32_t>(from.version);
  to.hash = static_cast<int64_t>(from.hash);
  to.image_size = static_cast<int32_t>(from.image_size);
  to.offset = static_cast<int32_t>(from.offset);
  to.size = static_cast<int16_t>(from.size);
  to.bytes.assign(from.bytes, from.bytes + from.size);
}

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

/// At most kMaxStatusName bytes, cut before a UTF-8 character that would not fit whole.
std::string Cut(const std::string& name) {
  if (name.size() <= kMaxStatusName) return name;
  size_t end = kMaxStatusName;
  while (end > 0 && (static_cast<uint8_t>(name[end]) & 0xc0) == 0x80) --end;
  return name.substr(0, end);
}

template <class T>
T ItemOr(const std::vector<T>& items, size_t i, const T& otherwise) {
  return i < items.size() ? items[i] : otherwise;
}

morphbus::fault_t ToFault(const vm::Fault& fault, const StatusNames& names, size_t i) {
  morphbus::fault_t out;
  out.code = static_cast<int16_t>(fault.code);
  out.text = Cut(ItemOr<std::string>(names.fault_texts, i, ""));
  out.function = Cut(ItemOr<std::string>(names.fault_functions, i, ""));
  out.line = static_cast<int16_t>(std::min<int>(fault.line, INT16_MAX));
  out.joint = static_cast<int8_t>(fault.joint);
  // What a program asked for may be anything; the wire carries finite numbers only.
  const auto finite = [](float v) {
    constexpr float kLargest = 3.4e38F;
    return v == v ? std::clamp(v, -kLargest, kLargest) : 0.0F;
  };
  out.value_deg = finite(fault.value);
  out.limit_deg = finite(fault.limit);
  return out;
}

morphbus::status_t StatusCore(const vm::StatusReport& report, const StatusNames& names,
                              uint16_t module_id, uint32_t incarnation, int num_joints) {
  morphbus::status_t out;
  out.module_id = static_cast<int16_t>(module_id);
  out.type_name = Cut(names.type_name);
  out.incarnation = static_cast<int32_t>(incarnation);
  out.role = report.role;
  out.role_name = Cut(names.role_name);
  out.frozen = report.frozen ? 1 : 0;
  out.has_pose = report.has_pose ? 1 : 0;
  out.pose_stale = report.pose_stale ? 1 : 0;
  for (size_t i = 0; i < report.num_labels; ++i) {
    morphbus::label_t label;
    label.name = Cut(ItemOr<std::string>(names.label_names, i, ""));
    const bool joint = i < names.label_is_joint.size() && names.label_is_joint[i];
    label.kind = joint ? morphbus::label_t::KIND_JOINT : morphbus::label_t::KIND_LINK;
    label.index = report.labels[i];
    out.labels.push_back(std::move(label));
  }
  out.num_labels = static_cast<int8_t>(out.labels.size());
  out.num_joints = static_cast<int8_t>(num_joints);
  out.joint_sign.assign(report.signs, report.signs + num_joints);
  out.num_tasks = out.num_faults = out.tasks_omitted = 0;
  out.faults_dropped = static_cast<int16_t>(std::min<int>(report.faults_dropped, INT16_MAX));
  return out;
}

size_t RoomIn(const morphbus::status_t& status) {
  const auto size = static_cast<size_t>(status.getEncodedSize());
  return size < kMaxPayloadBytes ? kMaxPayloadBytes - size : 0;
}

void AddTasks(const vm::StatusReport& report, const StatusNames& names, morphbus::status_t* out) {
  for (size_t i = 0; i < report.num_tasks; ++i) {
    morphbus::task_t task;
    task.kind = static_cast<int8_t>(report.tasks[i].kind);
    task.function = Cut(ItemOr<std::string>(names.task_functions, i, ""));
    task.line = static_cast<int16_t>(std::min<int>(report.tasks[i].line, INT16_MAX));
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
  out->module_id = static_cast<int16_t>(message.sender);
  out->incarnation = static_cast<int32_t>(message.incarnation);
  out->role = message.role;
  out->has_pose = message.has_pose ? 1 : 0;
  out->pose_stale = message.pose_stale ? 1 : 0;
  out->root_module = static_cast<int16_t>(message.root);
  out->root_incarnation = static_cast<int32_t>(message.root_incarnation);
  out->root_sequence = message.root_sequence;
  out->hops = static_cast<int16_t>(message.hops);
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
  InvocationsToWire(message, out);
  ProgramToWire(message, out);
}

void FromTransform(const morphbus::transform_t& message, vm::NeighbourMessage* out) {
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
  out->num_links = static_cast<uint8_t>(message.num_links);
  for (size_t i = 0; i < out->num_links; ++i) FromWirePose(message.link_poses[i], &out->X_RL[i]);
  out->num_docked = static_cast<uint8_t>(message.num_docked);
  for (size_t i = 0; i < out->num_docked; ++i) {
    out->docked[i] = {static_cast<uint8_t>(message.docked[i].connector),
                      static_cast<uint8_t>(message.docked[i].link),
                      static_cast<uint8_t>(message.docked[i].body_link),
                      static_cast<uint16_t>(message.docked[i].mate_module)};
  }
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
  out->joints.resize(static_cast<size_t>(num_joints));
  for (int i = 0; i < num_joints; ++i) {
    morphbus::joint_command_t& joint = out->joints[static_cast<size_t>(i)];
    joint.mode = static_cast<int8_t>(output.joints[i].mode);
    joint.target_si = output.joints[i].target;
    joint.speed_si = output.joints[i].speed;
  }
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
  if (reading.num_joints != num_joints) {
    return Fail(reading.name + " senses " + std::to_string(reading.num_joints) +
                " joints, its type has " + std::to_string(num_joints));
  }
  for (int i = 0; i < num_joints; ++i) {
    out->joint_position[i] = reading.joint_position_si[static_cast<size_t>(i)];
    out->joint_velocity[i] = static_cast<double>(reading.joint_velocity_si[static_cast<size_t>(i)]);
  }
  for (vm::ConnectorReading& connector : out->connectors) connector = vm::ConnectorReading();
  for (const morphbus::docked_connector_t& docked : reading.docked) {
    if (docked.connector >= num_connectors || out->connectors[docked.connector].docked) {
      return Fail(reading.name + " senses something at connector " +
                  std::to_string(docked.connector) + ", which its type does not have, or twice");
    }
    vm::ConnectorReading& connector = out->connectors[docked.connector];
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
  do {
    morphbus::status_t& message =
        messages.emplace_back(StatusCore(report, names, module_id, incarnation, num_joints));
    // Counted once.
    if (messages.size() > 1) message.faults_dropped = 0;
    while (fault < report.num_faults) {
      morphbus::fault_t one = ToFault(report.faults[fault], names, fault);
      if (static_cast<size_t>(one._getEncodedSizeNoHash()) > RoomIn(message)) break;
      message.faults.push_back(std::move(one));
      ++message.num_faults;
      ++fault;
    }
    AddTasks(report, names, &message);
    MORPHBUS_CHECK(fault >= report.num_faults || message.num_faults > 0);
  } while (fault < report.num_faults);
  return messages;
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
  constexpr size_t kRequests = 1 + vm::kMaxRequests * (14 + 4 * vm::kMaxArguments);
  constexpr size_t kPiece = 1 + 20 + kMaxDeployPiece;
  constexpr size_t kEmpty = kPartCore + kRequests + kPiece;
  std::vector<std::vector<size_t>> parts(1);
  size_t size = kEmpty;
  for (size_t i = 0; i < modules.size(); ++i) {
    const auto joints = static_cast<size_t>(modules[i].num_joints);
    const size_t most = 2 + 4 + modules[i].name.size() + 1 + 1 + joints * 12 + 1 +
                        static_cast<size_t>(std::min(most_docked[i], vm::kMaxNeighbours)) * 7;
    if (!parts.back().empty() && size + most > kMaxPayloadBytes) {
      parts.emplace_back();
      size = kEmpty;
    }
    parts.back().push_back(i);
    size += most;
  }
  return parts;
}

size_t WorldBodiesPerPart() { return (kMaxPayloadBytes - kPartCore) / kBodyBytes; }

}  // namespace morphbus::bridge
