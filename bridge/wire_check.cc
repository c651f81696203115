#include "bridge/wire_check.h"

#include <limits>
#include <morphbus/actuator_t.hpp>
#include <morphbus/ask_t.hpp>
#include <morphbus/control_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <string>
#include <type_traits>

#include "bridge/channels.h"
#include "bridge/codec.h"
#include "bridge/info_parts.h"
#include "bridge/vm_codec.h"
#include "bridge/wire_reader.h"
#include "vm/limits.h"

namespace morphbus::bridge {
namespace {

constexpr int64_t kMost16 = std::numeric_limits<int16_t>::max();
constexpr int64_t kMost32 = std::numeric_limits<int32_t>::max();
constexpr int64_t kMost64 = std::numeric_limits<int64_t>::max();
constexpr int64_t kLeast32 = std::numeric_limits<int32_t>::min();
constexpr int64_t kLeast64 = std::numeric_limits<int64_t>::min();
constexpr size_t kLongText = 200;  ///< Reasons, fault texts, builds: for people.
constexpr size_t kNameText = 64;   ///< Names of types, roles, functions.
constexpr int64_t kLastLink = vm::kMaxLinks - 1;
constexpr int64_t kLastJoint = vm::kMaxJoints - 1;
constexpr int64_t kLastConnector = vm::kMaxConnectors - 1;

/// Names the type whose layout a Walk describes; the order of calls is the order of its fields.
template <class M>
struct As {};

void Walk(WireReader& r, As<morphbus::header_t>) {
  r.Int32(kLeast32, kMost32);
  r.Int32(kLeast32, kMost32);
  r.Int64(0, kMost64);
  r.Int64(0, kMost64);
  r.Int64(0, kMost64);
  r.Skip(16);
}

void Walk(WireReader& r, As<morphbus::docked_connector_t>) {
  r.Int8(0, kLastConnector);
  r.Int8(0, kLastConnector);
  r.Int16(0, kMost16);
  r.Int8(0, 127);
  r.Int16(1, kMost16);
}

void Walk(WireReader& r, As<morphbus::module_sensors_t>) {
  r.Int16(0, kMost16);
  r.Text(kMaxProcessName);
  const int64_t joints = r.Int8(0, vm::kMaxJoints);
  r.Doubles(joints);
  r.Floats(joints);
  const int64_t docked = r.Int8(0, vm::kMaxNeighbours);
  for (int64_t i = 0; i < docked && r.ok(); ++i) Walk(r, As<morphbus::docked_connector_t>());
}

/// Number of this part and number of parts.
void WalkPart(WireReader& r) {
  const int64_t part = r.Int16(0, kMost16);
  if (r.Int16(1, kMost16) <= part) r.Refuse("a part's number is not below the number of parts");
}

/// Offset and size of a piece within an image of a size that was read before.
void WalkPiece(WireReader& r, int64_t image_size, int64_t most) {
  const int64_t offset = r.Int32(0, image_size);
  const int64_t size = r.Int16(1, most);
  if (offset + size > image_size) r.Refuse("a piece lies beyond the image's end");
  r.Skip(static_cast<size_t>(size));
}

void WalkRequest(WireReader& r) {
  r.Int16(0, kMost16);
  r.Int16(0, vm::kMaxRoles - 1);
  r.Int8(0, vm::kMaxRoutines - 1);
  const int64_t arguments = r.Int8(0, vm::kMaxArguments);
  r.Skip(8);
  r.Skip(static_cast<size_t>(4 * arguments));
}

void Walk(WireReader& r, As<morphbus::sensors_t>) {
  Walk(r, As<morphbus::header_t>());
  WalkPart(r);
  const int64_t modules = r.Int16(0, kMost16);
  for (int64_t i = 0; i < modules && r.ok(); ++i) Walk(r, As<morphbus::module_sensors_t>());
  const int64_t requests = r.Int8(0, vm::kMaxRequests);
  for (int64_t i = 0; i < requests && r.ok(); ++i) WalkRequest(r);
  const int64_t pieces = r.Int8(0, 1);
  for (int64_t i = 0; i < pieces && r.ok(); ++i) {
    r.Int16(0, kMost16);
    r.Skip(8);
    WalkPiece(r, r.Int32(1, vm::kMaxImageBytes), kMaxDeployPiece);
  }
}

void Walk(WireReader& r, As<morphbus::world_t>) {
  Walk(r, As<morphbus::header_t>());
  WalkPart(r);
  const int64_t bodies = r.Int16(0, kMost16);
  for (int64_t i = 0; i < bodies && r.ok(); ++i) {
    r.Int16(0, kMost16);
    r.Int8(0, kLastLink);
    r.Doubles(3);
    r.DoubleQuaternion();
  }
}

void Walk(WireReader& r, As<morphbus::sim_clock_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Int8(morphbus::sim_clock_t::PHASE_START, morphbus::sim_clock_t::PHASE_END);
  r.Int32(1, kMost32);
  r.Int16(0, kMost16);
  r.Int16(0, kMost16);
  r.Int16(0, kMost16);
  r.Text(kLongText);
  const int64_t controls = r.Int16(0, 64);
  for (int64_t i = 0; i < controls && r.ok(); ++i) r.Text(kLongText);
}

void Walk(WireReader& r, As<morphbus::invocation_t>) {
  r.Int16(0, kMost16);
  r.Int16(0, vm::kMaxRoles - 1);
  r.Int8(0, vm::kMaxRoutines - 1);
  const int64_t arguments = r.Int8(0, vm::kMaxArguments);
  r.Int32(0, kMost32);
  r.Int32(1, kMost32);
  r.Skip(8);
  r.Skip(static_cast<size_t>(4 * arguments));
}

void WalkProgram(WireReader& r) {
  r.Int32(0, kMost32);
  r.Skip(8);
  r.Int32(0, kMost32);
  r.Skip(8);
  r.Int32(0, vm::kMaxImageBytes);
  if (r.Int8(0, 1) == 0) return;
  r.Int32(0, kMost32);
  r.Skip(8);
  WalkPiece(r, r.Int32(1, vm::kMaxImageBytes), vm::kFragmentBytes);
}

void WalkTail(WireReader& r) {
  r.Int8(1, 127);
  const int64_t entries = r.Int8(0, vm::kMaxMessageBodyEntries);
  for (int64_t i = 0; i < entries && r.ok(); ++i) {
    r.Int8(0, kLastLink);
    r.Int8(0, kLastJoint);
    r.Int16(0, kMost16);
    r.Int32(kLeast32, kMost32);
  }
  const int64_t invocations = r.Int8(0, vm::kMaxMessageInvocations);
  for (int64_t i = 0; i < invocations && r.ok(); ++i) Walk(r, As<morphbus::invocation_t>());
  const int64_t acks = r.Int8(0, vm::kMaxMessageAcks);
  for (int64_t i = 0; i < acks && r.ok(); ++i) {
    r.Int16(0, kMost16);
    r.Int32(0, kMost32);
    r.Int32(0, kMost32);
    r.Int32(0, kMost32);
  }
  WalkProgram(r);
}

void Walk(WireReader& r, As<morphbus::transform_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Int16(0, kMost16);
  r.Int32(0, kMost32);
  r.Int16(-1, vm::kMaxRoles - 1);
  r.Bool();
  r.Bool();
  r.Int16(0, kMost16);
  r.Int32(0, kMost32);
  r.Int64(kLeast64, kMost64);
  r.Int16(0, kMost16);
  const int64_t links = r.Int8(0, vm::kMaxLinks);
  for (int64_t i = 0; i < links && r.ok(); ++i) {
    r.Floats(3);
    r.FloatQuaternion();
  }
  const int64_t docked = r.Int8(0, vm::kMaxNeighbours);
  for (int64_t i = 0; i < docked && r.ok(); ++i) {
    r.Int8(0, kLastConnector);
    r.Int8(0, kLastLink);
    r.Int8(0, kLastLink);
    r.Int16(0, kMost16);
  }
  WalkTail(r);
}

void Walk(WireReader& r, As<morphbus::actuator_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Int16(0, kMost16);
  r.Int64(0, kMost64);
  const int64_t joints = r.Int8(0, vm::kMaxJoints);
  for (int64_t i = 0; i < joints && r.ok(); ++i) {
    r.Int8(morphbus::joint_command_t::MODE_HOLD, morphbus::joint_command_t::MODE_VELOCITY);
    r.Doubles(2);
  }
  const int64_t connectors = r.Int8(0, vm::kMaxConnectors);
  for (int64_t i = 0; i < connectors && r.ok(); ++i) {
    r.Int8(0, kLastConnector);
    r.Int8(0, vm::kMaxConnectorStates - 1);
    r.Int8(0, 127);
  }
}

void WalkFault(WireReader& r) {
  r.Int16(0, kMost16);
  r.Text(kLongText);
  r.Text(kNameText);
  r.Int16(0, kMost16);
  r.Int8(-1, kLastJoint);
  r.Floats(2);
}

void Walk(WireReader& r, As<morphbus::status_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Int16(0, kMost16);
  r.Text(kNameText);
  r.Int32(0, kMost32);
  r.Int16(-1, vm::kMaxRoles - 1);
  r.Text(kNameText);
  r.Bool();
  r.Bool();
  r.Bool();
  const int64_t labels = r.Int8(0, vm::kMaxLabels);
  for (int64_t i = 0; i < labels && r.ok(); ++i) {
    r.Text(kNameText);
    r.Int8(morphbus::label_t::KIND_JOINT, morphbus::label_t::KIND_LINK);
    r.Int8(-1, kLastJoint > kLastLink ? kLastJoint : kLastLink);
  }
  const int64_t joints = r.Int8(0, vm::kMaxJoints);
  for (int64_t i = 0; i < joints && r.ok(); ++i) r.Int8(-1, 1);
  const int64_t tasks = r.Int8(0, vm::kMaxTasks);
  for (int64_t i = 0; i < tasks && r.ok(); ++i) {
    r.Int8(0, 3);
    r.Text(kNameText);
    r.Int16(0, kMost16);
  }
  r.Int8(0, 127);
  const int64_t faults = r.Int8(0, vm::kMaxFaultsPerTick);
  for (int64_t i = 0; i < faults && r.ok(); ++i) WalkFault(r);
  r.Int16(0, kMost16);
}

void WalkTotal(WireReader& r) {
  r.Text(kMaxChannelName);
  r.Int64(0, kMost64);
  r.Skip(8);
  r.Bool();
}

void Walk(WireReader& r, As<morphbus::ask_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Text(kMaxProcessName);
  r.Int8(morphbus::ask_t::KIND_RESEND, morphbus::ask_t::KIND_BYE);
  r.Text(kMaxChannelName);
  r.Int64(0, kMost64);
  r.Int64(0, kMost64);
  r.Int64(-1, kMost64);
  r.Text(32);
  const int64_t totals = r.Int16(0, 16);
  for (int64_t i = 0; i < totals && r.ok(); ++i) WalkTotal(r);
}

void Walk(WireReader& r, As<morphbus::hello_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Text(kMaxProcessName);
  r.Int32(0, kMost32);
  r.Skip(8);
  r.Int32(0, kMost32);
  r.Text(kNameText);
  r.Skip(16);
  r.Text(kLongText);
}

void Walk(WireReader& r, As<morphbus::health_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Text(kMaxProcessName);
  for (int i = 0; i < 13; ++i) r.Int64(0, kMost64);
}

void Walk(WireReader& r, As<morphbus::info_part_t>) {
  Walk(r, As<morphbus::header_t>());
  WalkPart(r);
  const int64_t total = r.Int32(0, static_cast<int64_t>(kMaxInfoBytes));
  r.Skip(static_cast<size_t>(r.Int32(0, total)));
}

void Walk(WireReader& r, As<morphbus::control_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Int64(0, kMost64);
  r.Text(kLongText);
  r.Skip(32);
}

void Walk(WireReader& r, As<morphbus::log_end_t>) {
  Walk(r, As<morphbus::header_t>());
  r.Text(kMaxRunName);
  r.Bool();
  r.Text(kLongText);
  r.Text(32);
  r.Int64(0, kMost64);
  const int64_t channels = r.Int16(0, kMost16);
  for (int64_t i = 0; i < channels && r.ok(); ++i) WalkTotal(r);
}

}  // namespace

template <class M>
Result<void> CheckWire(const uint8_t* data, size_t size) {
  // The end of a log stands in a file and lists every channel; all else travels as one datagram.
  if (!std::is_same_v<M, morphbus::log_end_t> && size > kMaxPayloadBytes) {
    return Fail("the message has " + std::to_string(size) + " bytes, more than " +
                std::to_string(kMaxPayloadBytes));
  }
  WireReader reader(data, size);
  reader.Skip(8);
  Walk(reader, As<M>());
  if (reader.ok()) reader.ExpectEnd();
  if (reader.ok()) return {};
  return Fail("at byte " + std::to_string(reader.position()) + ": " + reader.failure());
}

template Result<void> CheckWire<morphbus::sensors_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::world_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::sim_clock_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::transform_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::actuator_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::status_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::ask_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::hello_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::health_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::info_part_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::control_t>(const uint8_t*, size_t);
template Result<void> CheckWire<morphbus::log_end_t>(const uint8_t*, size_t);

}  // namespace morphbus::bridge
