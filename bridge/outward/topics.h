#pragma once
// What leaves the bus: topics, the schema of each, and the schemas themselves
// (docs/monitor-protocol.md).

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace morphbus::bridge {

/// A topic of a source. Its full name is "/", the source's name, "/", and `name` of its row.
enum class OutwardTopic : uint8_t {
  kDescription,
  kScene,
  kClock,
  kTransforms,
  kPropagated,
  kJoints,
  kJointStates,
  kCommands,
  kModules,
  kConnections,
  kFaults,
  kPrints,
  kTraces,
  kLog,
  kHealth,
  kChannels,
  kForces,
};

/// A row of the table of topics.
struct OutwardTopicInfo {
  OutwardTopic topic;
  /// The last part of its name.
  std::string_view name;
  /// Full name of the Protocol Buffers message that travels on it.
  std::string_view schema;
  /// True if a message says all there is to say at its time, so that the last one is worth having
  /// for who comes later; false if each message tells of an event.
  bool is_state;
};

/// All topics, in the order of OutwardTopic.
inline constexpr std::array<OutwardTopicInfo, 17> kOutwardTopics = {{
    {OutwardTopic::kDescription, "description", "morphbus.Description", true},
    {OutwardTopic::kScene, "scene", "foxglove.SceneUpdate", true},
    {OutwardTopic::kClock, "clock", "morphbus.Clock", true},
    {OutwardTopic::kTransforms, "tf", "foxglove.FrameTransforms", true},
    {OutwardTopic::kPropagated, "tf_propagated", "foxglove.FrameTransforms", true},
    {OutwardTopic::kJoints, "joints", "morphbus.Joints", true},
    {OutwardTopic::kJointStates, "joint_states", "foxglove.JointStates", true},
    {OutwardTopic::kCommands, "commands", "morphbus.Commands", true},
    {OutwardTopic::kModules, "modules", "morphbus.Modules", true},
    {OutwardTopic::kConnections, "connections", "morphbus.Connections", true},
    {OutwardTopic::kFaults, "faults", "morphbus.Fault", false},
    {OutwardTopic::kPrints, "prints", "morphbus.Print", false},
    {OutwardTopic::kTraces, "traces", "morphbus.Traces", false},
    {OutwardTopic::kLog, "log", "foxglove.Log", false},
    {OutwardTopic::kHealth, "health", "morphbus.Health", false},
    {OutwardTopic::kChannels, "channels", "morphbus.Channels", true},
    {OutwardTopic::kForces, "forces", "morphbus.Forces", true},
}};

/// The row of a topic.
constexpr const OutwardTopicInfo& RowOf(OutwardTopic topic) {
  return kOutwardTopics[static_cast<size_t>(topic)];
}

/// The full name of a topic: "/walk/tf".
std::string TopicPath(std::string_view source, OutwardTopic topic);

/// A serialized FileDescriptorSet with the message of this full name ("morphbus.Joints") and all
/// that it imports, each file after those that it imports. The name must be one of the table's
/// (checked).
std::string SchemaOf(std::string_view message);

}  // namespace morphbus::bridge
