#pragma once
// The messages of runs as listeners read them, be they from the bus or from a log: who is no party
// of a run decodes nothing but by this room.

#include <cstddef>
#include <cstdint>
#include <morphbus/actuator_t.hpp>
#include <morphbus/header_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/pose_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// A message of a run with a sound header, which is not decoded yet. It refers to the name of its
/// channel and to its bytes, and is valid as long as they are.
struct RunMessage {
  ChannelName name;
  morphbus::header_t header;
  const uint8_t* data = nullptr;
  size_t size = 0;
  /// Index of `name.process` among the modules that RunListener was given; -1 for any other.
  int module = -1;
};

/// A message on a channel of any run. Fails if the channel is none of a run's, or if protocol or
/// CRC are wrong.
Result<RunMessage> OpenMessage(std::string_view channel, const uint8_t* data, size_t size);
/// The same for a message whose name is known: checks its bytes and sets its header.
Result<void> ReadHeader(RunMessage* message);

/// What a listener does with messages, type by type; nothing by default. What is called gets sound
/// messages only, and may take out of them what it wants to keep.
class RunMessageHandler {
 public:
  virtual ~RunMessageHandler() = default;

  /// Whether a message shall be decoded. Of all others the bytes are checked, which takes less time
  /// than to decode them, and OnChecked() is called.
  virtual bool Decodes(const RunMessage& /*message*/) { return true; }
  /// A message that is sound and was not decoded: the fields below can be read.
  virtual void OnChecked(const RunMessage& /*message*/) {}

  /// By RunListener: a message with a sound header that came already, or too late.
  virtual void OnRepeat(const RunMessage& /*message*/) {}

  // A message of the type that its channel's topic has.
  virtual void OnClock(const RunMessage& /*message*/, morphbus::sim_clock_t&& /*clock*/) {}
  virtual void OnSensors(const RunMessage& /*message*/, morphbus::sensors_t&& /*sensors*/) {}
  virtual void OnWorld(const RunMessage& /*message*/, morphbus::world_t&& /*world*/) {}
  virtual void OnTransform(const RunMessage& /*message*/, morphbus::transform_t&& /*transform*/) {}
  virtual void OnActuator(const RunMessage& /*message*/, morphbus::actuator_t&& /*actuator*/) {}
  virtual void OnStatus(const RunMessage& /*message*/, morphbus::status_t&& /*status*/) {}
  virtual void OnHealth(const RunMessage& /*message*/, morphbus::health_t&& /*health*/) {}
  virtual void OnInfo(const RunMessage& /*message*/, morphbus::info_part_t&& /*part*/) {}
  virtual void OnEnd(const RunMessage& /*message*/, morphbus::log_end_t&& /*end*/) {}
};

/// Checks a message's body and gives it to `handler`. What parties of a run tell each other only
/// (HELLO, RESEND, CONTROL and the like) is passed over. Fails if the message is not what its topic
/// promises, and says which field is wrong; nothing is called then.
Result<void> ReadMessage(const RunMessage& message, RunMessageHandler* handler);

/// A message with a sound header as one of type M; nothing if it is of another type or its body is
/// not sound.
template <class M>
std::optional<M> DecodeAs(std::span<const uint8_t> bytes) {
  std::optional<M> decoded(std::in_place);
  if (!DecodeBody(bytes.data(), bytes.size(), &*decoded)) decoded.reset();
  return decoded;
}
template <class M>
std::optional<M> DecodeAs(const RunMessage& message) {
  return DecodeAs<M>(std::span(message.data, message.size));
}

// Single fields of a message that has been checked, read without decoding the rest.

/// Of any message: the sim time of its header, µs.
int64_t SimTimeOf(const RunMessage& message);
/// A message's place among those of its channel in one tick: number `part` of `count`. The count is
/// 0 for topics without a fixed number of messages a tick.
struct MessagePart {
  int64_t part = 0;
  int64_t count = 1;
};
MessagePart PartOf(const RunMessage& message);
/// Of an ACTUATOR: how many STATUS its module has published.
int64_t StatusCountOf(const RunMessage& message);
/// Of a TRANSFORM: the sender's role (-1: none), and whether it has poses and whether they age.
struct RoleAndPose {
  int16_t role = -1;
  bool has_pose = false;
  bool pose_stale = false;
};
RoleAndPose RoleAndPoseOf(const RunMessage& message);
/// Of a TRANSFORM: the poses X_RL of the sender's links.
std::vector<morphbus::pose_t> LinkPosesOf(const RunMessage& message);

}  // namespace morphbus::bridge
