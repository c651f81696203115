#include "test/support/synthetic_log.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <morphbus/info_part_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/sim_clock_t.hpp>
#include <numbers>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/info_parts.h"
#include "bridge/wire/stream_hash.h"
#include "compiler/base/check.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/model_proto.h"
#include "compiler/model/run_description.pb.h"
#include "logger/log/event_log.h"

namespace morphbus::test {
namespace {

using bridge::Topic;
using model::Pose;

constexpr double kUnit = 0.05;  ///< Half a module, m.
constexpr int64_t kTickUs = 20'000;
constexpr const char* kRoles[] = {"Root", "Middle", "Tip"};

Pose Turned(double x, bool about_y, bool about_x) {
  Pose pose = Pose::Identity();
  pose.translate(Eigen::Vector3d(x, 0, 0));
  if (about_y) pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  if (about_x) pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
  return pose;
}

model::ModuleType SegType() {
  model::ModuleType type;
  type.name = "Seg";
  for (const double side : {-1.0, 1.0}) {
    model::Link link;
    link.name = side < 0 ? "base" : "arm";
    link.mass_kg = 0.1;
    for (const double x : {0.0, side * kUnit}) {
      for (const double y : {-0.02, 0.02}) {
        for (const double z : {-0.02, 0.02}) link.hull.emplace_back(x, y, z);
      }
    }
    type.links.push_back(link);
    model::Connector connector;
    connector.name = side < 0 ? "c0" : "c1";
    connector.link = side < 0 ? 0 : 1;
    connector.p_MoCo_M = Eigen::Vector3d(side * kUnit, 0, 0);
    type.connectors.push_back(connector);
  }
  model::Joint joint;
  joint.name = "bend";
  joint.link_a = 1;
  joint.link_b = 0;
  joint.p_MoJo_M.setZero();
  joint.axis = Eigen::Vector3d::UnitZ();
  joint.lower = -1.5;
  joint.upper = 1.5;
  type.joints.push_back(joint);
  return type;
}

/// The same chain, told by each robot in its own way.
struct Member {
  const char* name;
  int sign;       ///< Of the joint against the script.
  int near_link;  ///< The link towards the root.
};

std::vector<Member> MembersOf(const std::string& robot) {
  // Back to front, the arm stays behind and the base turns on: about -z_M, which is +z of the
  // chain. Turned over, the arm turns about -z of the chain.
  if (robot == "two") return {{"k3", 1, 0}, {"k1", 1, 1}, {"k2", -1, 0}};
  return {{"m1", 1, 0}, {"m2", 1, 0}, {"m3", 1, 0}};
}

double Script(int joint, int64_t tick) {
  const double t = static_cast<double>(tick * kTickUs) * 1e-6;
  return 0.4 * std::sin(2.0 * t + joint) - 0.4 * std::sin(static_cast<double>(joint));
}

/// Builds the events of one run.
class Writer {
 public:
  explicit Writer(const SyntheticOptions& options)
      : options_(options),
        model_(SyntheticModel()),
        robot_(*model_.FindRobot(options.robot)),
        members_(MembersOf(options.robot)),
        now_us_(options.start_us) {
    const auto index = [&](const char* name) { return *robot_.FindModule(name); };
    for (const Member& member : members_) order_.push_back(index(member.name));
    model_hash_ = static_cast<int64_t>(model::ModelHash(model::SerializeModel(model_)));
  }

  std::vector<SyntheticEvent> Run();

 private:
  template <class M>
  void Emit(const std::string& channel, int64_t tick, M message,
            const std::function<void(M*)>& hook);
  void Tick(int64_t tick);
  void Clock(int64_t tick, int8_t phase);
  void Sensors(int64_t tick, const model::JointValues& q);
  void World(int64_t tick, const model::KinematicState& state);
  void Module(int64_t tick, size_t member, const model::KinematicState& state);
  void Status(int64_t tick, size_t member);
  void End();

  std::string ChannelOf(const char* process, Topic topic) const {
    return bridge::Channel(options_.run, process, topic);
  }
  template <class M>
  std::function<void(M*)> Bound(const std::function<void(const std::string&, M*)>& hook,
                                const std::string& module) const {
    if (!hook) return {};
    return [&hook, module](M* message) { hook(module, message); };
  }

  const SyntheticOptions& options_;
  model::Model model_;
  const model::Robot& robot_;
  std::vector<Member> members_;
  std::vector<int> order_;  ///< By member: index in the robot.
  int64_t model_hash_ = 0;
  int64_t now_us_ = 0;
  std::map<std::string, bridge::ChannelTotal> totals_;
  std::map<std::string, bridge::StreamHash> hashes_;
  std::map<std::string, int64_t> sequences_;
  std::vector<SyntheticEvent> events_;
};

template <class M>
void Writer::Emit(const std::string& channel, int64_t tick, M message,
                  const std::function<void(M*)>& hook) {
  message.header.protocol = header_t::PROTOCOL;
  message.header.tick = tick;
  message.header.sim_time_us = tick * kTickUs;
  message.header.sequence = sequences_[channel]++;
  message.header.model_hash = model_hash_;
  message.header.program_hash = 0;
  SyntheticEvent event;
  event.timestamp_us = now_us_ += 100;
  event.channel = channel;
  bridge::Encode(message, &event.payload);
  const std::vector<uint8_t> before = event.payload;
  if (hook) {
    hook(&message);
    bridge::Encode(message, &event.payload);
  }
  const std::vector<uint8_t>& vouched = options_.stale_end ? before : event.payload;
  bridge::ChannelTotal& total = totals_[channel];
  total.channel = channel;
  total.hashed = bridge::IsHashed(bridge::ParseChannel(channel)->topic);
  ++total.count;
  hashes_[channel].Update(vouched.data(), vouched.size());
  events_.push_back(std::move(event));
}

void Writer::Clock(int64_t tick, int8_t phase) {
  sim_clock_t clock{};
  clock.phase = phase;
  clock.tick_us = kTickUs;
  clock.num_modules = 3;
  clock.num_sensors_parts = 1;
  clock.num_world_parts = 1;
  Emit<sim_clock_t>(ChannelOf("SIM", Topic::kClock), tick, clock, {});
}

void Writer::Sensors(int64_t tick, const model::JointValues& q) {
  sensors_t sensors{};
  sensors.num_parts = 1;
  for (size_t m = 0; m < robot_.modules.size(); ++m) {
    module_sensors_t reading{};
    reading.module_id = static_cast<int16_t>(m);
    reading.name = robot_.modules[m].name;
    reading.num_joints = 1;
    reading.joint_position_si = q[m];
    reading.joint_velocity_si = {0.0f};
    reading.joint_effort_si = {0.0f};
    for (const model::Docking& d : robot_.dockings) {
      if (d.module_a != static_cast<int>(m)) continue;
      docked_connector_t docked{};
      docked.connector = static_cast<int8_t>(d.connector_a);
      docked.mate_connector = static_cast<int8_t>(d.connector_b);
      docked.mate_module = static_cast<int16_t>(d.module_b);
      docked.number = static_cast<int16_t>(d.option + 1);
      reading.docked.push_back(docked);
    }
    reading.num_docked = static_cast<int8_t>(reading.docked.size());
    sensors.modules.push_back(reading);
  }
  sensors.num_modules = static_cast<int16_t>(sensors.modules.size());
  Emit(ChannelOf("SIM", Topic::kSensors), tick, sensors, options_.on_sensors);
}

void Writer::World(int64_t tick, const model::KinematicState& state) {
  world_t world{};
  world.num_parts = 1;
  Pose X_WR = Pose::Identity();
  X_WR.translate(Eigen::Vector3d(0.001 * static_cast<double>(tick), 0.25, 0.0));
  X_WR.rotate(Eigen::AngleAxisd(0.0005 * static_cast<double>(tick), Eigen::Vector3d::UnitY()));
  const std::vector<std::vector<int>> body_of = model::BodiesOf(model_, robot_);
  int next = 0;
  for (size_t m = 0; m < body_of.size(); ++m) {
    for (size_t l = 0; l < body_of[m].size(); ++l) {
      if (body_of[m][l] != next) continue;
      ++next;
      body_pose_t body{};
      body.module_id = static_cast<int16_t>(m);
      body.link = static_cast<int8_t>(l);
      const Pose X_WL = X_WR * state.X_RL[m][l];
      const Eigen::Quaterniond q(X_WL.linear());
      Eigen::Map<Eigen::Vector3d>(body.position_m) = X_WL.translation();
      const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
      std::copy(wxyz, wxyz + 4, body.orientation_wxyz);
      world.bodies.push_back(body);
    }
  }
  world.num_bodies = static_cast<int16_t>(world.bodies.size());
  Emit(ChannelOf("SIM", Topic::kWorld), tick, world, options_.on_world);
}

void Writer::Status(int64_t tick, size_t member) {
  const Member& me = members_[member];
  status_t status{};
  status.module_id = static_cast<int16_t>(order_[member]);
  status.type_name = "Seg";
  status.incarnation = 1;
  status.has_pose = 1;
  status.role = -1;
  status.num_joints = 1;
  status.joint_sign = {0};
  if (tick >= options_.role_tick) {
    status.role = static_cast<int16_t>(member);
    status.role_name = member == 2 ? options_.tip_role : kRoles[member];
    const auto label = [](const char* name, int8_t kind, int index) {
      label_t out{};
      out.name = name;
      out.kind = kind;
      out.index = static_cast<int8_t>(index);
      return out;
    };
    status.labels = {label("bend", label_t::KIND_JOINT, 0),
                     label("near", label_t::KIND_LINK, me.near_link),
                     label("far", label_t::KIND_LINK, 1 - me.near_link)};
    status.num_labels = 3;
    status.joint_sign = {static_cast<int8_t>(me.sign)};
  }
  Emit(ChannelOf(me.name, Topic::kStatus), tick, status, Bound(options_.on_status, me.name));
}

void Writer::Module(int64_t tick, size_t member, const model::KinematicState& state) {
  const Member& me = members_[member];
  transform_t transform{};
  transform.module_id = static_cast<int16_t>(order_[member]);
  transform.incarnation = 1;
  transform.role = -1;
  transform.has_pose = 1;
  transform.root_module = static_cast<int16_t>(robot_.root_module);
  transform.root_incarnation = 1;
  for (const Pose& X_RL : state.X_RL[order_[member]]) {
    pose_t pose{};
    const Eigen::Quaterniond q(X_RL.linear());
    Eigen::Map<Eigen::Vector3f>(pose.position_m) = X_RL.translation().cast<float>();
    const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    for (int i = 0; i < 4; ++i) pose.orientation_wxyz[i] = static_cast<float>(wxyz[i]);
    transform.link_poses.push_back(pose);
  }
  transform.num_links = static_cast<int8_t>(transform.link_poses.size());
  transform.body_turns = 1;
  Emit(ChannelOf(me.name, Topic::kTransform), tick, transform,
       Bound(options_.on_transform, me.name));

  actuator_t actuator{};
  actuator.module_id = static_cast<int16_t>(order_[member]);
  actuator.num_joints = 1;
  joint_command_t command{};
  command.mode = joint_command_t::MODE_POSITION;
  command.target_si = me.sign * Script(static_cast<int>(member), tick + 1);
  command.speed_si = 3.0;
  actuator.joints = {command};
  actuator.status_count = sequences_[ChannelOf(me.name, Topic::kStatus)];
  Emit(ChannelOf(me.name, Topic::kActuator), tick, actuator, Bound(options_.on_actuator, me.name));
}

void Writer::Tick(int64_t tick) {
  model::JointValues q = model::StartValues(robot_);
  for (size_t i = 0; i < members_.size(); ++i) {
    q[order_[i]][0] = members_[i].sign * Script(static_cast<int>(i), tick);
  }
  const model::KinematicState state = model::ForwardKinematics(model_, robot_, q);
  Clock(tick, tick == 0 ? sim_clock_t::PHASE_START : sim_clock_t::PHASE_RUN);
  Sensors(tick, q);
  World(tick, state);
  for (size_t i = 0; i < members_.size(); ++i) {
    if (tick % 50 == 0 || tick == options_.role_tick) Status(tick, i);
    Module(tick, i, state);
  }
}

void Writer::End() {
  log_end_t end{};
  end.run = options_.run;
  end.clean = 1;
  end.reason = "10 s are over";
  end.num_ticks = options_.ticks;
  std::vector<bridge::ChannelTotal> hashed;
  for (auto& [channel, total] : totals_) {
    total.chained_hash = static_cast<int64_t>(hashes_[channel].Digest());
    end.channels.push_back(total);
    if (total.hashed) hashed.push_back(total);
  }
  end.num_channels = static_cast<int16_t>(end.channels.size());
  end.run_hash = bridge::RunHash(hashed);
  Emit<log_end_t>(ChannelOf("", Topic::kEnd), options_.ticks, end, {});
}

std::vector<SyntheticEvent> Writer::Run() {
  if (options_.description) {
    const std::string bytes = SyntheticDescription(options_.robot, options_.run);
    for (info_part_t& part : bridge::SplitInfo(bytes)) {
      Emit<info_part_t>(ChannelOf("", Topic::kInfo), 0, part, {});
    }
  }
  for (int64_t tick = 0; tick < options_.ticks; ++tick) Tick(tick);
  Clock(options_.ticks, sim_clock_t::PHASE_END);
  if (options_.end) End();
  return std::move(events_);
}

}  // namespace

model::Model SyntheticModel() {
  model::Model model;
  model.module_types.push_back(SegType());
  model::ConnectionType connection;
  connection.name = "Joint";
  const auto add = [&](int a, int b, const Pose& X_AB) {
    const int number = static_cast<int>(connection.options.size()) + 1;
    connection.options.push_back({number, a, b, X_AB, {}});
  };
  for (const bool over : {false, true}) {
    add(1, 0, Turned(2 * kUnit, false, over));
    add(0, 1, Turned(-2 * kUnit, false, over));
    add(1, 1, Turned(2 * kUnit, true, over));
    add(0, 0, Turned(-2 * kUnit, true, over));
  }
  connection.candidates = static_cast<int>(connection.options.size());
  model.connection_types.push_back(connection);

  model::Robot one;
  one.name = "one";
  for (const char* name : {"m1", "m2", "m3"}) one.modules.push_back({name, 0, {0.0}});
  one.dockings = {{0, 1, 1, 0, 0, 0}, {1, 1, 2, 0, 0, 0}};
  model::Robot two;
  two.name = "two";
  for (const char* name : {"k1", "k2", "k3"}) two.modules.push_back({name, 0, {0.0}});
  // k3's arm on k1's arm; on k1's base the base of k2, turned over: about y twice, about x once.
  two.dockings = {{2, 1, 0, 1, 0, 2}, {0, 0, 1, 0, 0, 7}};
  two.root_module = 2;
  model.robots = {one, two};
  return model;
}

std::string SyntheticDescription(const std::string& robot, const std::string& run) {
  proto::RunDescription d;
  const std::string bytes = model::SerializeModel(SyntheticModel());
  d.set_run(run);
  d.set_model(bytes);
  d.set_model_file("synthetic.m3l");
  d.set_model_hash(model::ModelHash(bytes));
  d.set_robot(robot);
  d.set_program_file("synthetic.dyn");
  d.set_root_module(robot == "two" ? "k3" : "m1");
  d.set_tick_us(kTickUs);
  d.set_mode("lockstep");
  d.set_build("test");
  return d.SerializeAsString();
}

std::vector<SyntheticEvent> SyntheticEvents(const SyntheticOptions& options) {
  return Writer(options).Run();
}

std::vector<uint8_t> EncodeLog(const std::vector<SyntheticEvent>& events) {
  std::vector<uint8_t> bytes;
  int64_t number = 0;
  for (const SyntheticEvent& event : events) {
    logger::AppendEvent(number++, event.timestamp_us, event.channel, event.payload, &bytes);
  }
  return bytes;
}

void WriteSyntheticLog(const std::string& path, const SyntheticOptions& options) {
  WriteBytes(path, EncodeLog(SyntheticEvents(options)));
}

void WriteBytes(const std::string& path, const std::vector<uint8_t>& bytes) {
  // Rewriting a file in place makes some file systems wait for the disk.
  std::remove(path.c_str());
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  MORPHBUS_CHECK(file.good());
}

}  // namespace morphbus::test
