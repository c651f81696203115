#include "bridge/wire/vm_codec.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

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
static_assert(SizeWithoutArrays<morphbus::transform_t>() + vm::kMaxSharedFields * sizeof(int32_t) +
                      vm::kMaxLinks * LargestSize<morphbus::pose_t>() +
                      vm::kMaxNeighbours * LargestSize<morphbus::docked_link_t>() +
                      vm::kMessageTailBytes <=
                  kMaxPayloadBytes,
              "the VM's limits overfill a datagram");
// A STATUS with the longest labels, and nothing else, leaves room for something that is held.
static_assert(SizeWithoutArrays<morphbus::status_t>() +
                      vm::kMaxLabels * (kMaxStatusName + 5 + 2 * sizeof(int8_t)) + vm::kMaxJoints +
                      HeldSplitter::kLeastRoom <=
                  kMaxPayloadBytes,
              "what a module holds could not be told");

/// Copies one number; whichever side is not const is written.
template <class Wire, class Vm>
void CopyOne(Wire& wire, Vm& vm) {
  using To = std::remove_const_t<Wire>;
  if constexpr (std::is_same_v<std::remove_const_t<Vm>, vm::Cell>) {
    // Arguments travel as the 32 bits of their cells; the program knows which are numbers.
    if constexpr (std::is_const_v<Wire>) {
      vm = vm::Cell::Int(wire);
    } else {
      wire = vm.AsInt();
    }
  } else if constexpr (std::is_const_v<Wire>) {
    vm = static_cast<Vm>(wire);
  } else if constexpr (std::is_same_v<To, int32_t> && std::is_same_v<const Vm, const int64_t>) {
    // Ticks of body entries travel in 32 bits: over a year of ticks of 20 ms; beyond that they stay
    // at the end of the range.
    wire = static_cast<To>(std::clamp<int64_t>(vm, INT32_MIN, INT32_MAX));
  } else {
    wire = static_cast<To>(vm);
  }
}

/// Copies fields between a struct of the wire and one of the VM, whichever way: the one that is
/// read is const. Both list their fields in the same order.
template <class... Wire, class... Vm>
void Copy(std::tuple<Wire&...> wire, std::tuple<Vm&...> vm) {
  [&]<size_t... I>(std::index_sequence<I...>) {
    (CopyOne(std::get<I>(wire), std::get<I>(vm)), ...);
  }
  (std::index_sequence_for<Wire...>());
}

/// Copies a list, element by element: on the wire a length and a vector, in the VM a length and an
/// array. Decode has seen to it that lengths fit the VM's arrays.
template <class Elements, class Array, class WireLength, class VmLength, class CopyElement>
void CopyList(WireLength& wire_length, Elements& wire, VmLength& vm_length, Array& vm,
              const CopyElement& copy) {
  Copy(std::tie(wire_length), std::tie(vm_length));
  if constexpr (!std::is_const_v<Elements>) wire.resize(static_cast<size_t>(vm_length));
  for (size_t i = 0; i < static_cast<size_t>(vm_length); ++i) copy(wire[i], vm[i]);
}

// What corresponds to what, for both ways.

/// Quaternions are w x y z on both sides.
constexpr auto kPose = [](auto& wire, auto& vm) {
  auto& p = wire.position_m;
  auto& q = wire.orientation_wxyz;
  Copy(std::tie(p[0], p[1], p[2], q[0], q[1], q[2], q[3]),
       std::tie(vm.p.x, vm.p.y, vm.p.z, vm.q.w, vm.q.x, vm.q.y, vm.q.z));
};

/// A value of the program, as the 32 bits of its cell.
constexpr auto kCell = [](auto& wire, auto& vm) { CopyOne(wire, vm); };

constexpr auto kDockedLink = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.connector, wire.link, wire.body_link, wire.mate_module),
       std::tie(vm.connector, vm.link, vm.body_link, vm.mate_module));
};

constexpr auto kBodyEntry = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.link, wire.joint, wire.module_id, wire.stamp_tick),
       std::tie(vm.link, vm.joint, vm.module, vm.stamp));
};

/// What an invocation and a request for one have in common: what is to run, under which image.
constexpr auto kCommand = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.role, wire.command, wire.program_hash),
       std::tie(vm.role, vm.command, vm.program_hash));
  CopyList(wire.num_arguments, wire.arguments, vm.num_arguments, vm.arguments,
           [](auto& to_or_from, auto& cell) { CopyOne(to_or_from, cell); });
};

constexpr auto kInvocation = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.origin_module, wire.target_module, wire.origin_incarnation, wire.id),
       std::tie(vm.origin, vm.target, vm.origin_incarnation, vm.id));
  kCommand(wire, vm);
};

/// Up to which invocation of an origin the sender has an unbroken row.
constexpr auto kAck = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.origin_module, wire.origin_incarnation, wire.id, wire.floor),
       std::tie(vm.origin, vm.origin_incarnation, vm.id, vm.floor));
};

/// The piece says which image it is of and where it belongs, so any mate can use it.
constexpr auto kProgramPiece = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.version, wire.hash, wire.image_size, wire.offset),
       std::tie(vm.version, vm.hash, vm.image_size, vm.offset));
  CopyList(wire.size, wire.bytes, vm.size, vm.bytes,
           [](auto& to_or_from, auto& byte) { CopyOne(to_or_from, byte); });
};

/// A neighbour message but for its fragment, of which the wire has a list and the VM one, and for
/// what the header says.
template <class Wire, class Vm>
void CopyMessage(Wire& wire, Vm& vm) {
  // Who speaks, what role it plays, and whose broadcast its poses rest on.
  Copy(std::tie(wire.module_id, wire.incarnation, wire.role, wire.has_pose, wire.pose_stale,
                wire.root_module, wire.root_incarnation, wire.root_sequence, wire.hops),
       std::tie(vm.sender, vm.incarnation, vm.role, vm.has_pose, vm.pose_stale, vm.root,
                vm.root_incarnation, vm.root_sequence, vm.hops));
  // What its role lets neighbours read.
  CopyList(wire.num_shared, wire.shared, vm.num_shared, vm.shared, kCell);
  // Where the sender's links are in the robot frame, and what is docked to them.
  CopyList(wire.num_links, wire.link_poses, vm.num_links, vm.X_RL, kPose);
  CopyList(wire.num_docked, wire.docked, vm.num_docked, vm.docked, kDockedLink);
  // Its share of news about joints that touch bodies, which are told in turns.
  Copy(std::tie(wire.body_turns), std::tie(vm.body_turns));
  CopyList(wire.num_body_entries, wire.body_entries, vm.num_body_entries, vm.body_entries,
           kBodyEntry);
  // Commands for others, and what program the sender runs and wants.
  CopyList(wire.num_invocations, wire.invocations, vm.num_invocations, vm.invocations, kInvocation);
  CopyList(wire.num_acks, wire.acks, vm.num_acks, vm.acks, kAck);
  auto& news = wire.news;
  Copy(std::tie(news.version, news.hash, news.want_version, news.want_hash, news.want_offset),
       std::tie(vm.news.version, vm.news.hash, vm.news.want_version, vm.news.want_hash,
                vm.news.want_offset));
}

/// Indices into the program's and the type's tables; whoever shows a fault looks the names up.
template <class Wire, class Vm>
void CopyFault(Wire& wire, Vm& vm) {
  Copy(std::tie(wire.code, wire.role, wire.rival_role, wire.function_index, wire.keyword,
                wire.joint, wire.link, wire.connector, wire.asked_axis, wire.ended_task,
                wire.task_function, wire.asked, wire.measured, wire.limit, wire.direction[0],
                wire.direction[1], wire.direction[2]),
       std::tie(vm.code, vm.role, vm.rival_role, vm.function, vm.keyword, vm.joint, vm.link,
                vm.connector, vm.asked_axis, vm.ended_task, vm.task_function, vm.asked, vm.measured,
                vm.limit, vm.direction_R.x, vm.direction_R.y, vm.direction_R.z));
}

/// Source lines and counts beyond what the wire has room for stay at the end of its range.
int16_t To16(uint16_t number) { return static_cast<int16_t>(std::min<int>(number, INT16_MAX)); }

/// Names longer than the message has room for.
std::string Cut(const std::string& name) { return CutText(name, kMaxStatusName); }

/// An item of a list, or something else where the list is shorter than the report.
template <class T>
T ItemOr(const std::vector<T>& items, size_t i, const T& otherwise) {
  return i < items.size() ? items[i] : otherwise;
}

morphbus::fault_t ToFault(const vm::Fault& fault) {
  morphbus::fault_t out;
  CopyFault(out, fault);
  out.line = To16(fault.line);
  // What a program asked for may be anything; the wire carries finite numbers only.
  constexpr float kLargest = 3.4e38F;
  for (float* number : {&out.asked, &out.measured, &out.limit, &out.direction[0], &out.direction[1],
                        &out.direction[2]}) {
    *number = std::isnan(*number) ? 0.0F : std::clamp(*number, -kLargest, kLargest);
  }
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
  Copy(std::tie(out.role, out.frozen, out.has_pose, out.pose_stale),
       std::tie(report.role, report.frozen, report.has_pose, report.pose_stale));
  out.role_name = Cut(names.role_name);
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
  Copy(std::tie(out.ended_behaviors, out.startup_ended),
       std::tie(report.ended_behaviors, report.startup_ended));
  out.num_tasks = out.num_faults = out.tasks_omitted = 0;
  out.faults_dropped = To16(report.faults_dropped);
  out.num_prints = out.num_inspections = 0;
  out.prints_dropped = To16(report.prints_dropped);
  return out;
}

/// Bytes left in the datagram.
size_t RoomIn(const morphbus::status_t& status) {
  const auto size = static_cast<size_t>(status.getEncodedSize());
  return size < kMaxPayloadBytes ? kMaxPayloadBytes - size : 0;
}

constexpr auto kPrint = [](auto& wire, auto& vm) {
  Copy(std::tie(wire.function_index, wire.text), std::tie(vm.function, vm.text));
  CopyList(wire.num_values, wire.values, vm.num_values, vm.values, kCell);
};

/// The value of a traced field, as a line that no function printed.
morphbus::print_t ToTrace(const vm::TraceReport& trace) {
  morphbus::print_t out;
  out.function_index = -1;
  out.line = 0;
  out.text = trace.field;
  out.num_values = 1;
  out.values = {static_cast<int32_t>(trace.value.bits)};
  return out;
}

/// How many printed lines and values of traced fields a report has.
size_t NumLines(const vm::StatusReport& report) {
  return size_t{report.num_prints} + report.num_traces;
}

/// Adds printed lines, and behind them the values of traced fields, from number `next` on as far as
/// they fit; returns the number of the next.
size_t AddPrints(const vm::StatusReport& report, size_t next, morphbus::status_t* out) {
  for (; next < NumLines(report) && out->num_prints < vm::kMaxPrintsPerTick; ++next) {
    morphbus::print_t print;
    if (next < report.num_prints) {
      kPrint(print, report.prints[next]);
      print.line = To16(report.prints[next].line);
    } else {
      print = ToTrace(report.traces[next - report.num_prints]);
    }
    if (static_cast<size_t>(print._getEncodedSizeNoHash()) > RoomIn(*out)) break;
    out->prints.push_back(std::move(print));
    ++out->num_prints;
  }
  return next;
}

/// Adds the tasks that fit, and counts those that do not.
void AddTasks(const vm::StatusReport& report, const StatusNames& names, morphbus::status_t* out) {
  for (size_t i = 0; i < report.num_tasks; ++i) {
    morphbus::task_t task;
    task.kind = static_cast<int8_t>(report.tasks[i].kind);
    task.function_name = Cut(ItemOr<std::string>(names.task_functions, i, ""));
    task.line = To16(report.tasks[i].line);
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
  CopyMessage(*out, message);
  // A piece of the own program, for those who ask.
  out->num_fragments = message.fragment.size > 0 ? 1 : 0;
  out->fragments.resize(static_cast<size_t>(out->num_fragments));
  for (morphbus::program_fragment_t& fragment : out->fragments) {
    kProgramPiece(fragment, message.fragment);
  }
}

void FromTransform(const morphbus::transform_t& message, vm::NeighbourMessage* out) {
  // Whatever the message does not mention is as in a fresh struct; without a fragment the VM's one
  // stays empty.
  *out = vm::NeighbourMessage();
  Copy(std::tie(message.header.tick, message.header.program_hash),
       std::tie(out->tick, out->program_hash));
  CopyMessage(message, *out);
  for (const morphbus::program_fragment_t& fragment : message.fragments) {
    kProgramPiece(fragment, out->fragment);
  }
}

void EncodeTransform(const vm::NeighbourMessage& message, std::vector<uint8_t>* out) {
  morphbus::transform_t wire = {};
  ToTransform(message, &wire);
  wire.header.protocol = morphbus::header_t::PROTOCOL;
  wire.header.tick = message.tick;
  wire.header.program_hash = static_cast<int64_t>(message.program_hash);
  Encode(wire, out);
}

Result<void> DecodeTransform(const uint8_t* data, size_t size, vm::NeighbourMessage* out) {
  morphbus::transform_t wire;
  if (Result<void> decoded = Decode(data, size, {}, &wire); !decoded) return decoded;
  FromTransform(wire, out);
  return {};
}

void ToActuator(const vm::TickOutput& output, uint16_t module_id, int num_joints,
                int64_t status_count, morphbus::actuator_t* out) {
  static_assert(
      static_cast<int8_t>(vm::ActuatorMode::kHold) == morphbus::joint_command_t::MODE_HOLD &&
      static_cast<int8_t>(vm::ActuatorMode::kVelocity) == morphbus::joint_command_t::MODE_VELOCITY);
  out->module_id = static_cast<int16_t>(module_id);
  out->status_count = status_count;
  // Every joint has a command in every tick, in the actuator's own sign.
  CopyList(out->num_joints, out->joints, std::as_const(num_joints), output.joints,
           [](morphbus::joint_command_t& joint, const vm::JointCommand& command) {
             Copy(std::tie(joint.mode, joint.target_si, joint.speed_si),
                  std::tie(command.mode, command.target, command.speed));
           });
  // Commands to connectors are few and are told one by one.
  CopyList(out->num_connectors, out->connectors, output.num_connector_commands,
           output.connector_commands,
           [](morphbus::connector_command_t& connector, const vm::ConnectorCommand& command) {
             Copy(std::tie(connector.connector, connector.state, connector.value),
                  std::tie(command.connector, command.state, command.value));
           });
}

Result<void> FromSensors(const morphbus::module_sensors_t& reading, int num_joints,
                         int num_connectors, int num_sensor_values, vm::TickInput* out) {
  // A reading of another module type cannot be used.
  if (reading.num_joints != num_joints) {
    return Fail(reading.name + " senses " + std::to_string(reading.num_joints) +
                " joints, its type has " + std::to_string(num_joints));
  }
  for (int i = 0; i < num_joints; ++i) {
    out->joint_position[i] = reading.joint_position_si[i];
    out->joint_velocity[i] = static_cast<double>(reading.joint_velocity_si[i]);
    out->joint_effort[i] = reading.joint_effort_si[i];
  }
  if (reading.num_sensor_values != num_sensor_values) {
    return Fail(reading.name + " senses " + std::to_string(reading.num_sensor_values) +
                " values, the sensors of its type have " + std::to_string(num_sensor_values));
  }
  for (int i = 0; i < num_sensor_values; ++i) out->sensor_values[i] = reading.sensor_value[i];
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
    Copy(std::tie(docked.mate_module, docked.mate_connector, docked.connection_type, docked.number),
         std::tie(connector.mate_module, connector.mate_connector, connector.connection_type,
                  connector.number));
  }
  return {};
}

std::vector<morphbus::status_t> ToStatus(const vm::StatusReport& report, const StatusNames& names,
                                         uint16_t module_id, uint32_t incarnation, int num_joints,
                                         const HeldState* held) {
  std::vector<morphbus::status_t> messages;
  size_t fault = 0, print = 0;
  std::optional<HeldSplitter> rest;
  if (held != nullptr) rest.emplace(*held);
  int16_t num_parts = 0;
  // As many messages as faults, printed lines and what is held need; each says the rest again, so
  // that any one can be read alone.
  do {
    morphbus::status_t& message =
        messages.emplace_back(StatusCore(report, names, module_id, incarnation, num_joints));
    // Counted once.
    if (messages.size() > 1) message.faults_dropped = message.prints_dropped = 0;
    while (fault < report.num_faults) {
      // As many faults as fit; the next message takes the rest.
      morphbus::fault_t one = ToFault(report.faults[fault]);
      if (static_cast<size_t>(one._getEncodedSizeNoHash()) > RoomIn(message)) break;
      message.faults.push_back(std::move(one));
      ++message.num_faults;
      ++fault;
    }
    if (fault >= report.num_faults) print = AddPrints(report, print, &message);
    MORPHBUS_CHECK(fault >= report.num_faults || message.num_faults > 0);
    MORPHBUS_CHECK(fault < report.num_faults || print >= NumLines(report) ||
                   message.num_prints > 0 || message.num_faults > 0);
    // What is held comes behind all of these, in messages without them, where there is room.
    if (rest && fault >= report.num_faults && print >= NumLines(report) &&
        message.num_faults == 0 && message.num_prints == 0) {
      message.inspections.push_back(rest->Next(RoomIn(message)));
      message.num_inspections = 1;
      ++num_parts;
    }
    // Tasks get the room that all this leaves.
    AddTasks(report, names, &message);
  } while (fault < report.num_faults || print < NumLines(report) || (rest && !rest->done()));
  for (morphbus::status_t& message : messages) {
    for (morphbus::inspection_t& part : message.inspections) part.num_parts = num_parts;
  }
  return messages;
}

vm::TraceReport FromTrace(const morphbus::print_t& print) {
  return {static_cast<uint8_t>(print.text), vm::Cell{static_cast<uint32_t>(print.values[0])}};
}

vm::PrintReport FromPrint(const morphbus::print_t& print) {
  vm::PrintReport out;
  kPrint(print, out);
  out.line = static_cast<uint16_t>(print.line);
  return out;
}

vm::Fault FromFault(const morphbus::fault_t& fault) {
  vm::Fault out;
  CopyFault(fault, out);
  out.line = static_cast<uint16_t>(fault.line);
  return out;
}

void ToRequest(const vm::InvokeRequest& request, uint16_t module_id,
               morphbus::invoke_request_t* out) {
  out->module_id = static_cast<int16_t>(module_id);
  kCommand(*out, request);
}

void ToRootPose(uint16_t module_id, uint8_t link, const vm::PoseF& X_RL,
                morphbus::root_pose_t* out) {
  out->module_id = static_cast<int16_t>(module_id);
  out->link = static_cast<int8_t>(link);
  kPose(out->pose, X_RL);
}

bool FromOrders(const morphbus::sensors_t& sensors, uint16_t module_id, vm::TickInput* input,
                std::vector<morphbus::deploy_piece_t>* pieces) {
  const auto id = static_cast<int16_t>(module_id);
  for (const morphbus::invoke_request_t& request : sensors.requests) {
    // Decode has seen to it that there are no more than the VM takes.
    if (request.module_id == id) kCommand(request, input->requests[input->num_requests++]);
  }
  for (const morphbus::root_pose_t& pose : sensors.root_poses) {
    if (pose.module_id != id) continue;
    input->has_root_pose = true;
    input->root_link = static_cast<uint8_t>(pose.link);
    kPose(pose.pose, input->X_RL_root);
  }
  pieces->clear();
  std::ranges::copy_if(sensors.pieces, std::back_inserter(*pieces),
                       [id](const auto& piece) { return piece.module_id == id; });
  return std::ranges::count(sensors.inspected, id) > 0;
}

std::vector<std::vector<size_t>> SplitSensors(
    const std::vector<morphbus::module_sensors_t>& modules, const std::vector<int>& most_docked) {
  // What a part takes without modules, and with all the orders it can carry.
  constexpr size_t kEmpty = SizeWithoutArrays<morphbus::sensors_t>() +
                            vm::kMaxRequests * LargestSize<morphbus::invoke_request_t>() +
                            LargestSize<morphbus::deploy_piece_t>() +
                            LargestSize<morphbus::root_pose_t>();
  std::vector<std::vector<size_t>> parts(1);
  size_t size = kEmpty;
  for (size_t i = 0; i < modules.size(); ++i) {
    // The reading with something docked at every connector.
    morphbus::module_sensors_t most = modules[i];
    most.docked.resize(std::min(most_docked[i], vm::kMaxNeighbours));
    most.num_docked = static_cast<int8_t>(most.docked.size());
    // Each module may be asked what it holds.
    const size_t bytes = static_cast<size_t>(most._getEncodedSizeNoHash()) + sizeof(int16_t);
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

size_t WorldLinksPerPart() {
  // Both have a fixed size, so division tells.
  return (kMaxPayloadBytes - SizeWithoutArrays<morphbus::world_t>()) /
         (LargestSize<morphbus::body_pose_t>() + LargestSize<morphbus::contact_force_t>());
}

}  // namespace morphbus::bridge
