// What leaves the bus, against the messages it is made of and against the reader of logs, which
// finds poses its own way.

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "bridge/outward/converter.h"
#include "bridge/outward/scene.h"
#include "bridge/wire/codec.h"
#include "compiler/model/model.pb.h"
#include "compiler/model/run_description.pb.h"
#include "logger/compare/kinematic_tracks.h"
#include "test/bridge/outward_collector.h"
#include "test/logger/temp_log.h"
#include "test/support/synthetic_log.h"

namespace morphbus::bridge {
namespace {

int64_t TimeUs(const google::protobuf::Timestamp& time) {
  return time.seconds() * 1'000'000 + time.nanos() / 1000;
}

/// The transforms of one message by child frame.
std::map<std::string, foxglove::FrameTransform> ByChild(const foxglove::FrameTransforms& message) {
  std::map<std::string, foxglove::FrameTransform> by_child;
  for (const foxglove::FrameTransform& t : message.transforms()) {
    EXPECT_TRUE(by_child.emplace(t.child_frame_id(), t).second) << t.child_frame_id();
  }
  return by_child;
}

model::Pose PoseOf(const foxglove::FrameTransform& t) {
  model::Pose X = model::Pose::Identity();
  X.translation() << t.translation().x(), t.translation().y(), t.translation().z();
  X.linear() =
      Eigen::Quaterniond(t.rotation().w(), t.rotation().x(), t.rotation().y(), t.rotation().z())
          .toRotationMatrix();
  return X;
}

TEST(Outward, ABodysLinkHasTheNumbersOfWorldBitForBit) {
  std::map<int64_t, std::vector<morphbus::body_pose_t>> world;
  test::SyntheticOptions options;
  options.on_world = [&](morphbus::world_t* message) {
    world[message->header.sim_time_us] = message->bodies;
  };
  const Collector collector = Convert(options);
  const auto messages = collector.Of<foxglove::FrameTransforms>(OutwardTopic::kTransforms);
  ASSERT_EQ(messages.size(), world.size());
  const auto run = Model(options);
  int compared = 0;
  for (const foxglove::FrameTransforms& message : messages) {
    const auto by_child = ByChild(message);
    const int64_t time_us = TimeUs(message.transforms(0).timestamp());
    ASSERT_TRUE(world.contains(time_us));
    for (const morphbus::body_pose_t& body : world[time_us]) {
      const auto found = by_child.find(LinkFrame("src", *run, body.module_id, body.link));
      ASSERT_NE(found, by_child.end());
      EXPECT_EQ(found->second.parent_frame_id(), "src/world");
      EXPECT_EQ(found->second.translation().x(), body.position_m[0]);
      EXPECT_EQ(found->second.translation().y(), body.position_m[1]);
      EXPECT_EQ(found->second.translation().z(), body.position_m[2]);
      EXPECT_EQ(found->second.rotation().w(), body.orientation_wxyz[0]);
      EXPECT_EQ(found->second.rotation().x(), body.orientation_wxyz[1]);
      EXPECT_EQ(found->second.rotation().y(), body.orientation_wxyz[2]);
      EXPECT_EQ(found->second.rotation().z(), body.orientation_wxyz[3]);
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Outward, AllLinksLieWhereTheReaderOfLogsFindsThem) {
  for (const std::string robot : {"one", "two"}) {
    test::SyntheticOptions options;
    options.robot = robot;
    const logger::TempLog file(options);
    const Result<logger::RunLog> log = logger::LoadRunLog(file.path());
    ASSERT_TRUE(log.has_value()) << log.error().message;
    const logger::SimulatedPoses simulated(*log);
    const auto messages = Convert(options).Of<foxglove::FrameTransforms>(OutwardTopic::kTransforms);
    ASSERT_EQ(messages.size(), log->world.size());
    const auto run = Model(options);
    for (size_t i = 0; i < messages.size(); ++i) {
      const auto by_child = ByChild(messages[i]);
      for (int m = 0; m < static_cast<int>(run->robot->modules.size()); ++m) {
        for (int l = 0; l < static_cast<int>(run->TypeOf(m).links.size()); ++l) {
          const std::optional<model::Pose> X_WL = simulated.X_WL(i, m, l);
          const auto found = by_child.find(LinkFrame("src", *run, m, l));
          ASSERT_EQ(found != by_child.end(), X_WL.has_value());
          if (!X_WL) continue;
          EXPECT_LT((PoseOf(found->second).matrix() - X_WL->matrix()).norm(), 1e-9);
        }
      }
    }
  }
}

TEST(Outward, PropagatedPosesAreThoseOfTransform) {
  std::map<std::string, std::vector<morphbus::pose_t>> last;
  test::SyntheticOptions options;
  options.on_transform = [&](const std::string& module, morphbus::transform_t* message) {
    last[module] = message->link_poses;
  };
  const auto messages = Convert(options).Of<foxglove::FrameTransforms>(OutwardTopic::kPropagated);
  ASSERT_EQ(static_cast<int>(messages.size()), options.ticks);
  const auto by_child = ByChild(messages.back());
  const auto run = Model(options);
  for (const auto& [module, poses] : last) {
    const int m = run->robot->FindModule(module).value();
    for (size_t l = 0; l < poses.size(); ++l) {
      const auto found = by_child.find(LinkFrame("src/propagated", *run, m, static_cast<int>(l)));
      ASSERT_NE(found, by_child.end());
      EXPECT_EQ(found->second.parent_frame_id(), "src/robot");
      EXPECT_EQ(found->second.translation().x(), poses[l].position_m[0]);
      EXPECT_EQ(found->second.rotation().w(), poses[l].orientation_wxyz[0]);
    }
  }
}

TEST(Outward, JointsAndCommandsAreThoseOfSensorsAndActuator) {
  std::map<int64_t, std::map<int, std::vector<double>>> positions;
  std::map<int64_t, std::map<std::string, double>> targets;
  test::SyntheticOptions options;
  options.on_sensors = [&](morphbus::sensors_t* message) {
    for (auto& module : message->modules) {
      module.joint_effort_si[0] = 0.25F * static_cast<float>(module.module_id + 1);
      positions[message->header.tick][module.module_id] = module.joint_position_si;
    }
  };
  options.on_actuator = [&](const std::string& module, morphbus::actuator_t* message) {
    targets[message->header.tick][module] = message->joints[0].target_si;
  };
  const Collector collector = Convert(options);
  const auto run = Model(options);
  const auto joints = collector.Of<morphbus::Joints>(OutwardTopic::kJoints);
  const auto states = collector.Of<foxglove::JointStates>(OutwardTopic::kJointStates);
  ASSERT_EQ(static_cast<int>(joints.size()), options.ticks);
  ASSERT_EQ(states.size(), joints.size());
  for (size_t i = 0; i < joints.size(); ++i) {
    for (int j = 0; j < joints[i].joints_size(); ++j) {
      const morphbus::JointValue& joint = joints[i].joints(j);
      const int m = run->robot->FindModule(joint.module()).value();
      EXPECT_EQ(joint.position(), positions[joints[i].tick()][m][0]);
      EXPECT_EQ(states[i].joints(j).name(), joint.module() + "/" + joint.joint());
      EXPECT_EQ(states[i].joints(j).position(), joint.position());
      EXPECT_EQ(joint.effort(), 0.25 * (m + 1));
      EXPECT_EQ(states[i].joints(j).effort(), joint.effort());
      // The target in force when a tick begins is that of the tick before.
      if (i > 0) {
        EXPECT_EQ(joint.target(), targets[joints[i].tick() - 1][joint.module()]);
      }
    }
  }
  const auto commands = collector.Of<morphbus::Commands>(OutwardTopic::kCommands);
  ASSERT_EQ(static_cast<int>(commands.size()), options.ticks);
  for (const morphbus::Commands& tick : commands) {
    EXPECT_EQ(tick.joints_size(), static_cast<int>(run->robot->modules.size()));
    for (const morphbus::JointOrder& order : tick.joints()) {
      EXPECT_EQ(order.target(), targets[tick.tick()][order.module()]);
    }
  }
}

TEST(Outward, WhatFaultsHaveEndedIsToldOfEveryModule) {
  test::SyntheticOptions options;
  options.robot = "two";
  options.on_status = [](const std::string& module, morphbus::status_t* status) {
    status->ended_behaviors = module == "m1" ? 2 : 0;
    status->startup_ended = module != "m1";
  };
  const auto messages = Convert(options).Of<morphbus::Modules>(OutwardTopic::kModules);
  ASSERT_FALSE(messages.empty());
  const morphbus::Modules& last = messages.back();
  ASSERT_GE(last.modules_size(), 1);
  for (const morphbus::ModuleState& state : last.modules()) {
    EXPECT_EQ(state.ended_behaviors(), state.module() == "m1" ? 2u : 0u);
    EXPECT_EQ(state.startup_ended(), state.module() != "m1");
  }
}

TEST(Outward, WithoutWorldTheLinksLieWhereTheirModulesBelieve) {
  test::SyntheticOptions options;
  Collector collector;
  const auto run = Model(options);
  Converter converter(run, "src", nullptr);
  for (const test::SyntheticEvent& event : test::SyntheticEvents(options)) {
    if (event.channel.ends_with("/WORLD")) continue;
    std::vector<uint8_t> payload = event.payload;
    if (event.channel.ends_with("/CLOCK")) {
      morphbus::sim_clock_t clock;
      ASSERT_TRUE(Decode(payload.data(), payload.size(), {}, &clock));
      clock.num_world_parts = 0;
      Encode(clock, &payload);
    }
    converter.Take(event.channel, payload.data(), payload.size(), collector.sink());
  }
  const auto links = collector.Of<foxglove::FrameTransforms>(OutwardTopic::kTransforms);
  const auto propagated = collector.Of<foxglove::FrameTransforms>(OutwardTopic::kPropagated);
  ASSERT_EQ(links.size(), propagated.size());
  ASSERT_FALSE(links.empty());
  const auto by_child = ByChild(links.back());
  const auto believed = ByChild(propagated.back());
  for (int m = 0; m < static_cast<int>(run->robot->modules.size()); ++m) {
    const auto& link = by_child.at(LinkFrame("src", *run, m, 0));
    EXPECT_EQ(link.parent_frame_id(), "src/robot");
    EXPECT_EQ(link.translation().x(),
              believed.at(LinkFrame("src/propagated", *run, m, 0)).translation().x());
  }
  // The robot stands on the ground: no corner lies below it at the start values, and one touches.
  double lowest = 1e9;
  const model::Pose X_WR = PoseOf(by_child.at("src/robot"));
  for (size_t m = 0; m < run->X_RL_start.size(); ++m) {
    for (size_t l = 0; l < run->X_RL_start[m].size(); ++l) {
      for (const Eigen::Vector3d& p_L : run->TypeOf(static_cast<int>(m)).links[l].hull) {
        lowest = std::min(lowest, (X_WR * run->X_RL_start[m][l] * p_L).y());
      }
    }
  }
  EXPECT_NEAR(lowest, 0.0, 1e-12);
}

TEST(Outward, UpInWorldIsUpForViewers) {
  const auto messages = Convert({}).Of<foxglove::FrameTransforms>(OutwardTopic::kTransforms);
  const auto base = ByChild(messages.front()).at("src/world");
  EXPECT_EQ(base.parent_frame_id(), "world");
  const model::Pose X = PoseOf(base);
  EXPECT_LT((X * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-15);  // up
  EXPECT_LT((X * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitX()).norm(), 1e-15);  // north
  EXPECT_LT((X * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitY()).norm(), 1e-15);  // east
}

TEST(Outward, TheSchemaOfEachTopicDecodesItsMessagesAlone) {
  const Collector collector = Convert({});
  for (const OutwardTopicInfo& row : kOutwardTopics) {
    google::protobuf::FileDescriptorSet set;
    ASSERT_TRUE(set.ParseFromString(SchemaOf(row.schema)));
    // A pool of its own knows nothing but what the schema brings along.
    google::protobuf::DescriptorPool pool;
    for (const auto& file : set.file()) ASSERT_NE(pool.BuildFile(file), nullptr) << file.name();
    const auto* type = pool.FindMessageTypeByName(std::string(row.schema));
    ASSERT_NE(type, nullptr) << row.schema;
    google::protobuf::DynamicMessageFactory factory;
    for (const Sent& sent : collector.sent) {
      if (sent.topic != row.topic) continue;
      const std::unique_ptr<google::protobuf::Message> message(factory.GetPrototype(type)->New());
      ASSERT_TRUE(message->ParseFromString(sent.bytes)) << row.name;
      EXPECT_TRUE(message->GetReflection()->GetUnknownFields(*message).empty()) << row.name;
    }
  }
}

TEST(Outward, HullsOfTheSceneAreTheModelsOwnAndFaceOutward) {
  const auto run = Model({});
  const foxglove::SceneUpdate scene = SceneOf("src", *run);
  ASSERT_EQ(scene.entities_size(), 6);  // Three modules of two links.
  for (const foxglove::SceneEntity& entity : scene.entities()) {
    EXPECT_TRUE(entity.frame_locked());
    EXPECT_EQ(entity.frame_id(), entity.id());
    const foxglove::TriangleListPrimitive& triangles = entity.triangles(0);
    const auto corner = [&](int i) {
      const foxglove::Point3& p = triangles.points(static_cast<int>(triangles.indices(i)));
      return Eigen::Vector3d(p.x(), p.y(), p.z());
    };
    // The volume by the divergence theorem is positive only if all corners run the right way.
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (int i = 0; i < triangles.indices_size(); ++i) centre += corner(i);
    centre /= triangles.indices_size();
    for (int i = 0; i < triangles.indices_size(); i += 3) {
      const Eigen::Vector3d a = corner(i), b = corner(i + 1), c = corner(i + 2);
      EXPECT_GT((b - a).cross(c - a).dot(a - centre), 0.0);
    }
  }
}

TEST(Outward, ALinkLooksAsItsModelSaysAndKeepsItsOwnColours) {
  proto::RunDescription description;
  ASSERT_TRUE(description.ParseFromString(test::SyntheticDescription("one", "synth")));
  proto::Model model;
  ASSERT_TRUE(model.ParseFromString(description.model()));
  // A tetrahedron in the module's colour, and a triangle in one of its own, on the first link of
  // all modules. The model's hash does not know of them.
  proto::LinkLooks* looks = model.add_looks();
  proto::VisualPart* hull = looks->add_parts();
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) hull->add_points(x);
  proto::VisualPart* triangle = looks->add_parts();
  for (const float x : {0, 0, 0, 1, 0, 0, 0, 1, 0}) triangle->add_points(x);
  for (const unsigned corner : {0u, 1u, 2u}) triangle->add_corners(corner);
  triangle->set_color(0x102030);
  description.set_model(model.SerializeAsString());
  const auto run = ReadRunWithRobot(description.SerializeAsString());
  ASSERT_TRUE(run) << run.error().message;
  const foxglove::SceneUpdate scene = SceneOf("src", **run);
  const foxglove::SceneEntity& entity = scene.entities(0);
  ASSERT_EQ(entity.triangles_size(), 2);
  EXPECT_EQ(entity.triangles(0).indices_size(), 12);
  EXPECT_EQ(entity.triangles(0).color().r(), ModuleColor(0).r());
  EXPECT_EQ(entity.triangles(1).indices_size(), 3);
  EXPECT_EQ(entity.triangles(1).color().b(), 48 / 255.0);
  const foxglove::KeyValuePair& last = entity.metadata(entity.metadata_size() - 1);
  EXPECT_EQ(last.key() + " " + last.value(), "own_colors 1");
  for (const auto& pair : scene.entities(1).metadata()) {
    EXPECT_NE(pair.key(), "own_colors") << "the other link looks like its hull";
  }
}

TEST(Outward, ObstaclesStandInTheRunsWorldFrame) {
  proto::RunDescription description;
  ASSERT_TRUE(description.ParseFromString(test::SyntheticDescription("one", "synth")));
  description.set_world(
      "<sdf version='1.9'><world name='w'><model name='wall'><static>true</static>"
      "<pose>1 2 3 0 0 0</pose><link name='l'><collision name='c'><geometry><box>"
      "<size>0.2 0.4 0.6</size></box></geometry></collision></link></model></world></sdf>");
  const auto run = ReadRunWithRobot(description.SerializeAsString());
  ASSERT_TRUE(run.has_value());
  const foxglove::SceneUpdate scene = SceneOf("src", **run);
  ASSERT_EQ(scene.entities_size(), 7);
  const foxglove::SceneEntity& wall = scene.entities(6);
  EXPECT_EQ(wall.id(), "src/obstacles/wall.l.c");
  EXPECT_EQ(wall.frame_id(), "src/world");
  Eigen::AlignedBox3d box;
  for (const foxglove::Point3& p : wall.triangles(0).points()) {
    box.extend(Eigen::Vector3d(p.x(), p.y(), p.z()));
  }
  // SDFormat's y looks west, which is -z of W, and its z is up, which is y.
  EXPECT_LT((box.center() - Eigen::Vector3d(1, 3, -2)).norm(), 1e-12);
  EXPECT_LT((box.sizes() - Eigen::Vector3d(0.2, 0.6, 0.4)).norm(), 1e-12);
  // A mesh is its triangles.
  proto::RunDescription meshes = description;
  meshes.set_world(
      "<sdf version='1.9'><world name='w'><model name='m'><static>true</static><link name='l'>"
      "<collision name='c'><geometry><mesh><uri>a.stl</uri></mesh></geometry></collision></link>"
      "</model></world></sdf>");
  proto::WorldMesh& mesh = *meshes.add_world_meshes();
  mesh.set_uri("a.stl");
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.5F}) mesh.add_points(x);
  for (const uint32_t corner : {0U, 1U, 2U}) mesh.add_corners(corner);
  const auto with_mesh = ReadRunWithRobot(meshes.SerializeAsString());
  ASSERT_TRUE(with_mesh.has_value());
  const foxglove::SceneUpdate surface = SceneOf("src", **with_mesh);
  ASSERT_EQ(surface.entities_size(), 7);
  EXPECT_EQ(surface.entities(6).triangles(0).points_size(), 3);
  EXPECT_EQ(surface.entities(6).triangles(0).indices_size(), 3);
  EXPECT_EQ(surface.entities(6).triangles(0).points(2).y(), 0.5) << "up";
  // A world that cannot be read does not keep the robot from being seen.
  description.set_world("<sdf>");
  const auto without = ReadRunWithRobot(description.SerializeAsString());
  ASSERT_TRUE(without.has_value());
  EXPECT_EQ(SceneOf("src", **without).entities_size(), 6);
}

TEST(Outward, WhatComesAgainLateOrDamagedChangesNothing) {
  const test::SyntheticOptions options;
  const Collector expected = Convert(options);
  Collector collector;
  Converter converter(Model(options), "src", nullptr);
  converter.Begin(collector.sink());
  int damaged = 0;
  for (const test::SyntheticEvent& event : test::SyntheticEvents(options)) {
    const auto take = [&](const std::vector<uint8_t>& bytes) {
      return converter.Take(event.channel, bytes.data(), bytes.size(), collector.sink());
    };
    std::vector<uint8_t> broken = event.payload;
    broken[broken.size() / 2] ^= 0x10;
    damaged += take(broken) ? 0 : 1;
    EXPECT_TRUE(take(event.payload));
    EXPECT_TRUE(take(event.payload));
    // Other runs and channels that are nobody's leave no trace.
    converter.Take("other/" + event.channel.substr(event.channel.find('/') + 1),
                   event.payload.data(), event.payload.size(), collector.sink());
  }
  converter.Finish(collector.sink());
  EXPECT_GT(damaged, 100);
  ASSERT_EQ(collector.sent.size(), expected.sent.size());
  for (size_t i = 0; i < expected.sent.size(); ++i) {
    EXPECT_EQ(collector.sent[i].bytes, expected.sent[i].bytes);
  }
}

TEST(Outward, ATickThatCannotHaveBegunIsRefused) {
  const test::SyntheticOptions options;
  Collector collector;
  Converter converter(Model(options), "src", nullptr);
  for (const test::SyntheticEvent& event : test::SyntheticEvents(options)) {
    converter.Take(event.channel, event.payload.data(), event.payload.size(), collector.sink());
    if (!event.channel.ends_with("/SENSORS")) continue;
    morphbus::sensors_t sensors;
    ASSERT_TRUE(Decode(event.payload.data(), event.payload.size(), {}, &sensors));
    std::vector<uint8_t> forged;
    sensors.header.tick += 1'000'000;
    sensors.header.sequence += 1'000'000;
    Encode(sensors, &forged);
    EXPECT_FALSE(converter.Take(event.channel, forged.data(), forged.size(), collector.sink()));
    sensors.header.sim_time_us = int64_t{1} << 62;
    Encode(sensors, &forged);
    EXPECT_FALSE(converter.Take(event.channel, forged.data(), forged.size(), collector.sink()));
  }
  EXPECT_EQ(static_cast<int>(collector.Of<morphbus::Joints>(OutwardTopic::kJoints).size()),
            options.ticks);
}

TEST(Outward, ALostPartLeavesOutItsModulesAndNothingElse) {
  const test::SyntheticOptions options;
  Collector collector;
  Converter converter(Model(options), "src", nullptr);
  int dropped = 0;
  for (const test::SyntheticEvent& event : test::SyntheticEvents(options)) {
    // The ACTUATORs of one module are lost in every second tick.
    if (event.channel.ends_with("/m2/ACTUATOR") && ++dropped % 2 == 0) continue;
    converter.Take(event.channel, event.payload.data(), event.payload.size(), collector.sink());
  }
  converter.Finish(collector.sink());
  const auto commands = collector.Of<morphbus::Commands>(OutwardTopic::kCommands);
  ASSERT_EQ(static_cast<int>(commands.size()), options.ticks);
  for (size_t i = 0; i < commands.size(); ++i) {
    EXPECT_EQ(commands[i].tick(), static_cast<int64_t>(i));
    EXPECT_EQ(commands[i].joints_size(), i % 2 == 0 ? 3 : 2);
  }
}

TEST(Outward, ACopyGoesOnAsItsOriginalDoes) {
  const test::SyntheticOptions options;
  const std::vector<test::SyntheticEvent> events = test::SyntheticEvents(options);
  Converter original(Model(options), "src", nullptr);
  Collector begun;
  const size_t half = events.size() / 2;
  for (size_t i = 0; i < half; ++i) {
    original.Take(events[i].channel, events[i].payload.data(), events[i].payload.size(),
                  begun.sink());
  }
  Converter copy = original;
  Collector a, b;
  for (size_t i = half; i < events.size(); ++i) {
    original.Take(events[i].channel, events[i].payload.data(), events[i].payload.size(), a.sink());
  }
  for (size_t i = half; i < events.size(); ++i) {
    copy.Take(events[i].channel, events[i].payload.data(), events[i].payload.size(), b.sink());
  }
  ASSERT_EQ(a.sent.size(), b.sent.size());
  ASSERT_FALSE(a.sent.empty());
  for (size_t i = 0; i < a.sent.size(); ++i) EXPECT_EQ(a.sent[i].bytes, b.sent[i].bytes);
}

TEST(Outward, OfADescriptionWhatCannotBeUsedIsLeftOut) {
  proto::RunDescription description;
  ASSERT_TRUE(description.ParseFromString(test::SyntheticDescription("one", "synth")));
  proto::KinematicsImage& image = *description.add_kinematics();
  image.set_type_name("Seg");
  image.set_image("damaged");
  const auto without_images = ReadRunWithRobot(description.SerializeAsString());
  ASSERT_TRUE(without_images.has_value());
  EXPECT_FALSE((*without_images)->has_program);
  EXPECT_EQ((*without_images)->images.FindKinematics("Seg"), nullptr);
  EXPECT_NE((*without_images)->images_problem, "");
  // A log can be read without its robot, and viewers have nothing to show.
  description.set_robot("another");
  const auto without_robot = ReadRunModel(description.SerializeAsString());
  ASSERT_TRUE(without_robot.has_value());
  EXPECT_EQ((*without_robot)->robot, nullptr);
  EXPECT_EQ((*without_robot)->run, "synth");
  EXPECT_EQ((*without_robot)->problem, "the model in the description has no robot 'another'");
  EXPECT_FALSE(ReadRunWithRobot(description.SerializeAsString()).has_value());
}

TEST(Outward, ADescriptionThatIsNoneIsRefused) {
  EXPECT_FALSE(ReadRunWithRobot("").has_value());
  std::string bytes = test::SyntheticDescription("one", "synth");
  EXPECT_FALSE(ReadRunWithRobot(bytes.substr(0, bytes.size() / 2)).has_value());
}

}  // namespace
}  // namespace morphbus::bridge
