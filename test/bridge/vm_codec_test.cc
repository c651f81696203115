// What the VM says and is told, as messages: how much fits, and what is cut where.

#include "bridge/wire/vm_codec.h"
#include "bridge/wire/status_codec.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <random>
#include <string>
#include <vector>

#include "bridge/wire/codec.h"

namespace morphbus::bridge {
namespace {

TEST(VmCodec, TheFullestNeighbourMessageFitsADatagramAndSurvives) {
  std::mt19937 random(2);
  vm::NeighbourMessage message;
  message.num_links = vm::kMaxLinks;
  message.num_docked = vm::kMaxNeighbours;
  // As the VM shares out the tail.
  int left = vm::kMessageTailBytes;
  while (message.num_invocations < vm::kMaxMessageInvocations) {
    vm::Invocation& invocation = message.invocations[message.num_invocations++];
    invocation.num_arguments = vm::kMaxArguments;
    invocation.id = 1;
    left -= vm::kInvocationWireBytes;
  }
  while (message.num_acks < vm::kMaxMessageAcks) {
    ++message.num_acks;
    left -= vm::kAckWireBytes;
  }
  for (; left >= vm::kBodyEntryWireBytes && message.num_body_entries < vm::kMaxMessageBodyEntries;
       left -= vm::kBodyEntryWireBytes) {
    message.body_entries[message.num_body_entries++].stamp =
        static_cast<int64_t>(random() % 100000);
  }
  morphbus::transform_t wire;
  ToTransform(message, &wire);
  wire.header = morphbus::header_t();
  wire.header.protocol = morphbus::header_t::PROTOCOL;
  wire.header.tick = wire.header.sim_time_us = wire.header.sequence = 0;
  wire.header.model_hash = wire.header.program_hash = 0;
  std::vector<uint8_t> bytes;
  Encode(wire, &bytes);
  EXPECT_LE(bytes.size(), kMaxPayloadBytes);
  morphbus::transform_t decoded;
  const auto result = Decode(bytes.data(), bytes.size(), {}, &decoded);
  ASSERT_TRUE(result) << result.error().message;
  vm::NeighbourMessage back;
  FromTransform(decoded, &back);
  EXPECT_EQ(back.num_body_entries, message.num_body_entries);
  for (int i = 0; i < back.num_body_entries; ++i) {
    EXPECT_EQ(back.body_entries[i].stamp, message.body_entries[i].stamp);
  }
}

TEST(VmCodec, TracedValuesTravelBehindPrintedLinesAndAreNone) {
  vm::StatusReport report{};
  report.num_prints = vm::kMaxPrintsPerTick;
  for (int i = 0; i < vm::kMaxPrintsPerTick; ++i) {
    report.prints[i].function = static_cast<int16_t>(i);
    report.prints[i].num_values = 1;
  }
  report.num_traces = 2;
  report.traces[0] = {3, vm::Cell::Float(-1.5F)};
  report.traces[1] = {31, vm::Cell::Int(7)};
  std::vector<morphbus::print_t> lines;
  for (const morphbus::status_t& status : ToStatus(report, StatusNames(), 1, 1, 0)) {
    lines.insert(lines.end(), status.prints.begin(), status.prints.end());
  }
  // More than one message holds go into the next.
  ASSERT_EQ(lines.size(), size_t{vm::kMaxPrintsPerTick} + 2);
  for (int i = 0; i < vm::kMaxPrintsPerTick; ++i) EXPECT_FALSE(IsTrace(lines[i])) << i;
  for (int i = 0; i < 2; ++i) {
    const morphbus::print_t& line = lines[vm::kMaxPrintsPerTick + i];
    ASSERT_TRUE(IsTrace(line)) << i;
    EXPECT_EQ(FromTrace(line).field, report.traces[i].field);
    EXPECT_EQ(FromTrace(line).value.bits, report.traces[i].value.bits);
  }
}

TEST(VmCodec, AStatusWithMoreFaultsThanFitBecomesSeveral) {
  vm::StatusReport report{};
  report.role = 0;
  report.num_labels = vm::kMaxLabels;
  report.num_tasks = vm::kMaxTasks;
  report.num_faults = vm::kMaxFaultsPerTick;
  report.faults_dropped = 3;
  for (int i = 0; i < vm::kMaxFaultsPerTick; ++i) {
    report.faults[i].code = vm::FaultCode::kStalled;
    report.faults[i].line = static_cast<uint16_t>(i + 1);
    report.faults[i].asked = std::numeric_limits<float>::quiet_NaN();
  }
  StatusNames names;
  const std::string longest(200, 'x');
  names.type_name = names.role_name = longest;
  names.label_names.assign(vm::kMaxLabels, longest);
  names.task_functions.assign(vm::kMaxTasks, longest);
  std::vector<morphbus::status_t> messages = ToStatus(report, names, 1, 1, vm::kMaxJoints);
  EXPECT_GT(messages.size(), 1u);
  int line = 0, dropped = 0;
  for (morphbus::status_t& message : messages) {
    message.header.protocol = morphbus::header_t::PROTOCOL;
    message.header.tick = message.header.sim_time_us = message.header.sequence = 0;
    std::vector<uint8_t> bytes;
    Encode(message, &bytes);
    EXPECT_LE(bytes.size(), kMaxPayloadBytes);
    morphbus::status_t decoded;
    const auto result = Decode(bytes.data(), bytes.size(), {}, &decoded);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(decoded.num_labels, vm::kMaxLabels) << "labels are never left out";
    EXPECT_EQ(decoded.num_tasks + decoded.tasks_omitted, vm::kMaxTasks);
    for (const morphbus::fault_t& fault : decoded.faults) EXPECT_EQ(fault.line, ++line);
    dropped += decoded.faults_dropped;
  }
  EXPECT_EQ(line, vm::kMaxFaultsPerTick) << "every fault, once, in order";
  EXPECT_EQ(dropped, 3);
}

TEST(VmCodec, NamesAreCutBetweenCharacters) {
  vm::StatusReport report{};
  StatusNames names;
  names.type_name = fmt::format("{:a<47}ä", "");  // 49 bytes; the 48th is half a character.
  EXPECT_EQ(ToStatus(report, names, 0, 1, 0).front().type_name, std::string(47, 'a'));
}

TEST(VmCodec, SensorsPartsFitWhateverIsDocked) {
  for (const int connectors : {6, vm::kMaxConnectors}) {
    std::vector<morphbus::module_sensors_t> modules(100);
    for (size_t i = 0; i < modules.size(); ++i) {
      modules[i].module_id = static_cast<int16_t>(i);
      modules[i].name = "module_" + std::to_string(i);
      modules[i].num_joints = 2;
      modules[i].joint_position_si.assign(2, 0);
      modules[i].joint_velocity_si.assign(2, 0);
      modules[i].joint_effort_si.assign(2, 0);
    }
    const auto parts = SplitSensors(modules, std::vector<int>(100, connectors));
    size_t next = 0;
    for (const std::vector<size_t>& part : parts) {
      morphbus::sensors_t sensors;
      for (const size_t i : part) {
        EXPECT_EQ(i, next++) << "in order, each once";
        morphbus::module_sensors_t full = modules[i];
        full.docked.resize(static_cast<size_t>(std::min(connectors, vm::kMaxNeighbours)));
        full.num_docked = static_cast<int8_t>(full.docked.size());
        sensors.modules.push_back(full);
      }
      sensors.num_modules = static_cast<int16_t>(sensors.modules.size());
      vm::InvokeRequest request;
      request.num_arguments = vm::kMaxArguments;
      sensors.num_requests = vm::kMaxRequests;
      for (int r = 0; r < vm::kMaxRequests; ++r)
        ToRequest(request, 1, &sensors.requests.emplace_back());
      sensors.num_pieces = 1;
      sensors.pieces.resize(1);
      sensors.pieces[0].size = kMaxDeployPiece;
      sensors.pieces[0].bytes.resize(kMaxDeployPiece);
      sensors.num_root_poses = 1;
      sensors.root_poses.resize(1);
      // All modules of the part are inspected.
      sensors.num_inspected = static_cast<int8_t>(part.size());
      sensors.inspected.resize(part.size());
      EXPECT_LE(static_cast<size_t>(sensors.getEncodedSize()), kMaxPayloadBytes);
    }
    EXPECT_EQ(next, 100u);
  }
}

TEST(VmCodec, NineTypicalModulesNeedOneSensorsPart) {
  std::vector<morphbus::module_sensors_t> modules(9);
  for (morphbus::module_sensors_t& module : modules) {
    module.name = "m1";
    module.num_joints = 2;
  }
  EXPECT_EQ(SplitSensors(modules, std::vector<int>(9, 6)).size(), 1u);
}

TEST(VmCodec, OwnReadingsMustFitTheType) {
  morphbus::module_sensors_t reading;
  reading.name = "m1";
  reading.num_joints = 1;
  reading.num_sensor_values = 0;
  reading.joint_position_si = {0.5};
  reading.joint_velocity_si = {0};
  reading.joint_effort_si = {-1.5F};
  morphbus::docked_connector_t docked;
  docked.connector = 3;
  docked.mate_module = 7;
  reading.docked = {docked};
  vm::TickInput input;
  ASSERT_TRUE(FromSensors(reading, 1, 4, 0, &input));
  EXPECT_EQ(input.joint_position[0], 0.5);
  EXPECT_EQ(input.joint_effort[0], -1.5F);
  EXPECT_TRUE(input.connectors[3].docked);
  EXPECT_EQ(input.connectors[3].mate_module, 7);
  EXPECT_FALSE(FromSensors(reading, 2, 4, 0, &input)) << "joints";
  EXPECT_FALSE(FromSensors(reading, 1, 3, 0, &input)) << "connector beyond the type's";
  reading.docked = {docked, docked};
  EXPECT_FALSE(FromSensors(reading, 1, 4, 0, &input)) << "one connector twice";
  reading.docked.clear();
  reading.num_sensor_values = 2;
  reading.sensor_value = {0.25F, 1.0F};
  ASSERT_TRUE(FromSensors(reading, 1, 4, 2, &input));
  EXPECT_EQ(input.sensor_values[0], 0.25F);
  EXPECT_EQ(input.sensor_values[1], 1.0F);
  EXPECT_FALSE(FromSensors(reading, 1, 4, 3, &input)) << "sensors of another type";
}

}  // namespace
}  // namespace morphbus::bridge
