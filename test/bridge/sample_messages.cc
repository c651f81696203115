#include "test/bridge/sample_messages.h"

#include <morphbus/actuator_t.hpp>
#include <morphbus/admit_t.hpp>
#include <morphbus/control_answer_t.hpp>
#include <morphbus/control_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/hello_t.hpp>
#include <morphbus/info_part_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/replay_batch_t.hpp>
#include <morphbus/replay_follow_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/verdict_t.hpp>
#include <morphbus/world_t.hpp>

#include "bridge/wire/codec.h"
#include "bridge/wire/health.h"
#include "bridge/wire/info_parts.h"
#include "bridge/wire/status_codec.h"
#include "bridge/wire/vm_codec.h"

namespace morphbus::bridge {
namespace {

void FillHeader(morphbus::header_t* header) {
  header->protocol = morphbus::header_t::PROTOCOL;
  header->tick = 1234;
  header->sim_time_us = 24680000;
  header->sequence = 1234;
  header->model_hash = 0x1122334455667788;
  header->program_hash = -0x1122334455667788;
}

template <class M>
Result<std::vector<uint8_t>> Recode(const uint8_t* data, size_t size) {
  M message;
  if (morphbus::Result<void> r = Decode(data, size, {}, &message); !r)
    return Fail(r.error().message);
  std::vector<uint8_t> again;
  Encode(message, &again);
  return again;
}

template <class M>
SampleMessage Sample(const std::string& type, M message) {
  FillHeader(&message.header);
  SampleMessage sample{type, {}, &Recode<M>};
  Encode(message, &sample.bytes);
  return sample;
}

morphbus::transform_t Transform() {
  vm::NeighbourMessage message;
  message.sender = 3;
  message.incarnation = 1;
  message.role = 2;
  message.num_shared = 2;
  message.shared[0] = vm::Cell::Float(-0.5F);
  message.shared[1] = vm::Cell::Int(3);
  message.has_pose = true;
  message.root = 1;
  message.root_incarnation = 1;
  message.root_sequence = 1230;
  message.hops = 2;
  message.num_links = 3;
  for (int i = 0; i < 3; ++i) message.X_RL[i].p = {0.1F * static_cast<float>(i), -0.5F, 2.0F};
  message.num_docked = 2;
  message.docked[0] = {1, 0, 0, 4};
  message.docked[1] = {5, 2, 2, 6};
  message.body_turns = 2;
  message.num_body_entries = 2;
  message.body_entries[0] = {0, 1, 4, 1200};
  message.body_entries[1] = {2, 0, 6, 1201};
  message.num_invocations = 1;
  message.invocations[0].origin = 7;
  message.invocations[0].origin_incarnation = 1;
  message.invocations[0].id = 9;
  message.invocations[0].program_hash = 0xfedcba9876543210;
  message.invocations[0].role = 1;
  message.invocations[0].command = 2;
  message.invocations[0].num_arguments = 2;
  message.invocations[0].arguments[0] = vm::Cell::Float(1.5F);
  message.invocations[0].arguments[1] = vm::Cell::Int(-1);
  message.num_acks = 1;
  message.acks[0] = {7, 1, 8, 3};
  message.news.version = 2;
  message.news.hash = 77;
  message.fragment.version = 2;
  message.fragment.hash = 77;
  message.fragment.image_size = 300;
  message.fragment.offset = 256;
  message.fragment.size = 44;
  morphbus::transform_t out;
  ToTransform(message, &out);
  return out;
}

morphbus::sensors_t Sensors() {
  morphbus::sensors_t sensors;
  sensors.part = 0;
  sensors.num_parts = 2;
  for (int i = 0; i < 2; ++i) {
    morphbus::module_sensors_t& reading = sensors.modules.emplace_back();
    reading.module_id = static_cast<int16_t>(i);
    reading.name = "m" + std::to_string(i + 1);
    reading.num_joints = 2;
    reading.joint_position_si = {0.5, -1.25};
    reading.joint_velocity_si = {0.0F, 3.5F};
    reading.joint_effort_si = {-1.5F, 0.25F};
    reading.num_sensor_values = 2;
    reading.sensor_value = {0.75F, 1.0F};
    reading.num_docked = 1;
    morphbus::docked_connector_t docked;
    docked.connector = 2;
    docked.mate_connector = 3;
    docked.mate_module = static_cast<int16_t>(1 - i);
    docked.connection_type = 0;
    docked.number = 17;
    reading.docked.push_back(docked);
  }
  sensors.num_modules = 2;
  vm::InvokeRequest request;
  request.num_arguments = 1;
  ToRequest(request, 1, &sensors.requests.emplace_back());
  sensors.num_requests = 1;
  morphbus::deploy_piece_t& piece = sensors.pieces.emplace_back();
  piece.module_id = 1;
  piece.hash = 5;
  piece.image_size = 100;
  piece.offset = 50;
  piece.size = 3;
  piece.bytes = {1, 2, 3};
  sensors.num_pieces = 1;
  vm::PoseF X_RL;
  X_RL.p = {0.25F, 0.5F, -1.0F};
  ToRootPose(1, 1, X_RL, &sensors.root_poses.emplace_back());
  sensors.num_root_poses = 1;
  sensors.inspected = {1, 0};
  sensors.num_inspected = 2;
  return sensors;
}

morphbus::status_t Status() {
  vm::StatusReport report{};
  report.role = 1;
  report.num_labels = 1;
  report.labels[0] = 1;
  report.signs[0] = -1;
  report.signs[1] = 0;
  report.num_tasks = 1;
  report.tasks[0].line = 12;
  report.num_faults = 1;
  report.faults[0] = {};
  report.faults[0].code = vm::FaultCode::kTargetClamped;
  report.faults[0].asked = 95;
  report.faults[0].limit = 90;
  report.faults[0].ended_task = static_cast<int8_t>(vm::TaskKind::kCommand);
  report.faults[0].task_function = 4;
  report.ended_behaviors = 2;
  report.startup_ended = true;
  report.num_prints = 1;
  report.prints_dropped = 2;
  report.prints[0].function = 4;
  report.prints[0].line = 17;
  report.prints[0].text = 5;
  report.prints[0].num_values = 2;
  report.prints[0].values[0] = vm::Cell::Float(1.5F);
  report.prints[0].values[1] = vm::Cell::Int(-7);
  StatusNames names;
  names.type_name = "MTRAN";
  names.role_name = "Knee";
  names.label_names = {"joint"};
  names.label_is_joint = {true};
  names.task_functions = {"Knee.bend"};
  return ToStatus(report, names, 3, 1, 2).front();
}

/// A STATUS that answers an order to inspect the module.
morphbus::status_t Inspection() {
  vm::StatusReport report{};
  StatusNames names;
  names.type_name = "MTRAN";
  HeldState held;
  held.fields = {{"speed", "float", "2.5"}};
  held.tasks = {
      {vm::TaskKind::kBehavior,
       "Knee.bend",
       vm::WaitKind::kMotion,
       0,
       "joint_1",
       {{"Knee.turn", 14, {{"angle", "float", "30"}, {"i", "int", "2"}}}, {"Knee.bend", 12, {}}}}};
  return ToStatus(report, names, 3, 1, 2, &held).front();
}

morphbus::totals_t Totals() {
  const morphbus::channel_total_t total{"walk/m3/STATUS", 12, -3, 1};
  return {{}, "m3", -1, 1, 3, -5, 2, {total, total}};
}

morphbus::world_t World() {
  morphbus::world_t world;
  world.part = 0;
  world.num_parts = 1;
  world.bodies.resize(2);
  world.num_bodies = 2;
  for (morphbus::body_pose_t& body : world.bodies) {
    body.module_id = 1;
    body.link = 0;
    for (double& p : body.position_m) p = 0.25;
    for (double& q : body.orientation_wxyz) q = 0.5;
  }
  morphbus::contact_force_t& contact = world.contacts.emplace_back();
  contact.module_id = 1;
  contact.link = 2;
  for (float& f : contact.force_n) f = -2.5F;
  world.num_contacts = 1;
  return world;
}

morphbus::actuator_t Actuator() {
  vm::TickOutput output;
  output.joints[1] = {vm::ActuatorMode::kPosition, 0.5, 1.0};
  output.num_connector_commands = 1;
  output.connector_commands[0] = {4, 0, 1};
  morphbus::actuator_t actuator;
  ToActuator(output, 3, 2, 17, &actuator);
  return actuator;
}

}  // namespace

std::vector<SampleMessage> SampleMessages() {
  morphbus::sim_clock_t clock;
  clock.phase = morphbus::sim_clock_t::PHASE_END;
  clock.tick_us = 20000;
  clock.num_modules = 9;
  clock.num_sensors_parts = 1;
  clock.num_world_parts = 2;
  clock.end_reason = "stopped";
  clock.controls = {"pause", "speed 2"};
  clock.num_controls = 2;
  morphbus::hello_t hello;
  hello.process = "m3";
  hello.pid = 4711;
  hello.claim = -5;
  hello.incarnation = 1;
  hello.type_name = "MTRAN";
  hello.kinematics_hash = 1;
  hello.wire_hash = 2;
  hello.arithmetic_hash = 3;
  hello.build = "0.1.0";
  Ledger ledger;
  ledger.received = 5;
  ledger.unauthentic = 3;
  ledger.unauthentic_channels = {{"m2/ACTUATOR", 2}, {"HELLO", 1}};
  morphbus::health_t health = MakeHealth("m3", ledger);
  morphbus::lateness_t& lateness = health.lateness.emplace_back();
  lateness.module_name = "m7";
  lateness.missed = 5;
  lateness.late = 4;
  lateness.worst_us = 30000;
  health.num_lateness = 1;
  morphbus::topic_total_t& total = health.totals.emplace_back();
  total.topic = "ACTUATOR";
  total.count = 7;
  total.chained_hash = -3;
  health.num_totals = 1;
  morphbus::control_t control;
  control.counter = 3;
  control.kind = morphbus::control_t::KIND_PUSH;
  control.module_name = "m5";
  control.part_name = "c1";
  control.num_steps = 1;
  control.speed = 0;
  control.direction[0] = 0.5;
  control.direction[1] = 0;
  control.direction[2] = -2;
  control.force_n = 20;
  control.duration_s = 0.5;
  control.cold = 0;
  control.program_hash = -7;
  control.arguments = {"30deg", "$NORTH"};
  control.num_arguments = 2;
  control.has_time = 1;
  control.time_s = 12.5;
  morphbus::control_answer_t answer;
  answer.counter = 3;
  answer.state = morphbus::control_answer_t::STATE_REFUSED;
  answer.tick = 412;
  answer.status = 2;
  answer.reason = "m5 has no 'c1'";
  answer.command = "push m5.c1 0.5,0,-2 20 0.5";
  answer.has_time = 0;
  answer.time_s = 0;
  morphbus::log_end_t end;
  end.run = "walk";
  end.open = 0;
  end.clean = 1;
  end.reason = "finished";
  end.run_hash = "0123456789abcdef0123456789abcdef";
  end.num_ticks = 100;
  end.channels = Totals().totals;
  end.num_channels = 2;
  return {Sample("transform_t", Transform()),
          Sample("sensors_t", Sensors()),
          Sample("status_t", Status()),
          Sample("totals_t", Totals()),
          Sample("world_t", World()),
          Sample("actuator_t", Actuator()),
          Sample("sim_clock_t", clock),
          Sample("hello_t", hello),
          Sample("health_t", health),
          Sample("control_t", control),
          Sample("info_part_t", SplitInfo("about this run").front()),
          Sample("log_end_t", end),
          Sample("status_t", Inspection()),
          Sample("resend_t", morphbus::resend_t{{}, "SIM", "walk/m3/ACTUATOR", 5, 7}),
          Sample("progress_t", morphbus::progress_t{{}, -1, 1}),
          Sample("verdict_t", morphbus::verdict_t{{}, "m2 does not answer"}),
          Sample("leave_t", morphbus::leave_t{{}, "m2"}),
          Sample("admit_t", morphbus::admit_t{{}, "m2", 77, -1, 40, 3}),
          Sample("replay_batch_t", morphbus::replay_batch_t{{}, 4, 1, 60, -9, 1}),
          Sample("replay_follow_t", morphbus::replay_follow_t{{}, "F1", -1, 0}),
          Sample("control_answer_t", answer)};
}

}  // namespace morphbus::bridge
