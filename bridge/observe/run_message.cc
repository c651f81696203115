#include "bridge/observe/run_message.h"

#include <utility>

#include "bridge/wire/codec.h"
#include "bridge/wire/wire_peek.h"

namespace morphbus::bridge {
namespace {

/// Reads the body of a message of type M, as far as the handler wants it.
template <class M>
Result<void> ReadAs(const RunMessage& message, RunMessageHandler* handler,
                    void (RunMessageHandler::*take)(const RunMessage&, M&&)) {
  // A reader who does not want the contents has them checked only, which allocates nothing.
  if (!handler->Decodes(message)) {
    Result<void> sound = CheckBody<M>(message.data, message.size);
    if (sound) handler->OnChecked(message);
    return sound;
  }
  M decoded;
  Result<void> sound = DecodeBody(message.data, message.size, &decoded);
  if (sound) (handler->*take)(message, std::move(decoded));
  return sound;
}

}  // namespace

Result<RunMessage> OpenMessage(std::string_view channel, const uint8_t* data, size_t size) {
  // The channel says which type the bytes should have; the header is of the same form in all types.
  const std::optional<ChannelName> name = ParseChannel(channel);
  if (!name) return Fail("the channel is none of a run's");
  RunMessage message{*name, {}, data, size};
  const Result<void> sound = ReadHeader(&message);
  if (!sound) return tl::unexpected(sound.error());
  return message;
}

Result<void> ReadHeader(RunMessage* message) {
  return DecodeHeader(message->data, message->size, &message->header);
}

Result<void> ReadMessage(const RunMessage& message, RunMessageHandler* handler) {
  using Handler = RunMessageHandler;
  switch (message.name.topic) {
    case Topic::kClock:
      return ReadAs(message, handler, &Handler::OnClock);
    case Topic::kSensors:
      return ReadAs(message, handler, &Handler::OnSensors);
    case Topic::kWorld:
      return ReadAs(message, handler, &Handler::OnWorld);
    case Topic::kTransform:
      return ReadAs(message, handler, &Handler::OnTransform);
    case Topic::kActuator:
      return ReadAs(message, handler, &Handler::OnActuator);
    case Topic::kStatus:
      return ReadAs(message, handler, &Handler::OnStatus);
    case Topic::kHealth:
      return ReadAs(message, handler, &Handler::OnHealth);
    case Topic::kInfo:
      return ReadAs(message, handler, &Handler::OnInfo);
    case Topic::kEnd:
      return ReadAs(message, handler, &Handler::OnEnd);
    // The types that only a run's own processes exchange have no reader here.
    default:
      return {};
  }
}

int64_t SimTimeOf(const RunMessage& message) { return PeekSimTime(message.data); }

MessagePart PartOf(const RunMessage& message) {
  switch (message.name.topic) {
    case Topic::kSensors:
    case Topic::kWorld:
      return {PeekPart(message.data), PeekParts(message.data)};
    case Topic::kClock:
    case Topic::kTransform:
    case Topic::kActuator:
      return {};
    // Of the others a tick has no fixed number.
    default:
      return {0, 0};
  }
}

int64_t StatusCountOf(const RunMessage& message) { return PeekStatusCount(message.data); }

RoleAndPose RoleAndPoseOf(const RunMessage& message) {
  return {PeekRole(message.data), PeekHasPose(message.data), PeekPoseStale(message.data)};
}

std::vector<morphbus::pose_t> LinkPosesOf(const RunMessage& message) {
  // Poses are fetched without decoding the rest of the message, of which a log has a million.
  std::vector<morphbus::pose_t> poses;
  PeekLinkPoses(message.data, &poses);
  return poses;
}

}  // namespace morphbus::bridge
