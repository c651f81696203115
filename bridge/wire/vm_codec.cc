#include "bridge/wire/vm_codec.h"

#include <algorithm>
#include <iterator>
#include <tuple>

#include "bridge/wire/codec.h"
#include "bridge/wire/field_copy.h"
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
// What corresponds to what, for both ways.

/// Quaternions are w x y z on both sides.
constexpr auto kPose = [](auto& wire, auto& vm) {
  auto& p = wire.position_m;
  auto& q = wire.orientation_wxyz;
  Copy(std::tie(p[0], p[1], p[2], q[0], q[1], q[2], q[3]),
       std::tie(vm.p.x, vm.p.y, vm.p.z, vm.q.w, vm.q.x, vm.q.y, vm.q.z));
};

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
