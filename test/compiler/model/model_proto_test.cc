#include "compiler/model/model_proto.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

#include "compiler/model/kinematic_graph.h"
#include "test/compiler/solver/known_modules.h"

namespace morphbus::model {
namespace {

Model FullModel() {
  Model model = test::MtranModel(0.0325);
  model.robots = {test::Quadruped(model, 0.0325), test::EquivalentQuadruped(model, 0.0325)};
  Connector& c = model.module_types[0].connectors[0];
  c.normals["_1"] = Eigen::Vector3d::UnitZ();
  c.attributes["length"] = 0.25;
  c.states.push_back({"mode", {std::string("slow"), std::string("fast")}});
  ConnectionOption& option = model.connection_types[0].options[0];
  option.other_states = {{{false, "extended", false}}, {{false, "extended", true}}};
  model.module_types[0].joints[1].type = JointType::kContinuous;
  model.module_types[0].joints[1].lower = -std::numeric_limits<double>::infinity();
  model.module_types[0].joints[1].upper = std::numeric_limits<double>::infinity();
  return model;
}

TEST(ModelProto, ReadsBackToTheVeryBytes) {
  const Model model = FullModel();
  const std::string bytes = SerializeModel(model);
  const Result<Model> again = ParseModel(bytes);
  ASSERT_TRUE(again.has_value()) << again.error().message;
  EXPECT_EQ(SerializeModel(*again), bytes);
  EXPECT_EQ(ModelHash(SerializeModel(*again)), ModelHash(bytes));
}

TEST(ModelProto, KeepsPosesExactly) {
  const Model model = FullModel();
  const Result<Model> again = ParseModel(SerializeModel(model));
  ASSERT_TRUE(again.has_value()) << again.error().message;
  const Robot& robot = model.robots[0];
  const KinematicState before = ForwardKinematics(model, robot, StartValues(robot));
  const KinematicState after =
      ForwardKinematics(*again, again->robots[0], StartValues(again->robots[0]));
  for (size_t m = 0; m < before.X_RL.size(); ++m) {
    for (size_t l = 0; l < before.X_RL[m].size(); ++l) {
      EXPECT_EQ(before.X_RL[m][l].matrix(), after.X_RL[m][l].matrix());
    }
  }
}

TEST(ModelProto, CarriesTheKinematicGraph) {
  const proto::Model message = ToProto(FullModel());
  const proto::KinematicGraph& graph = message.robots(0).graph();
  EXPECT_EQ(graph.mobility(), 16u);
  EXPECT_EQ(graph.joints_size(), 18);
  EXPECT_EQ(graph.bodies_size(), 18);
  EXPECT_TRUE(graph.joints(8).locked());
}

TEST(ModelProto, RejectsEveryIndexAndNumberThatIsNotSound) {
  const proto::Model good = ToProto(FullModel());
  ASSERT_TRUE(FromProto(good).has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<const char*, std::function<void(proto::Model&)>>> damages = {
      {"joint 'joint_1': link 7 of 3",
       [](auto& m) { m.mutable_module_types(0)->mutable_joints(0)->set_link_a(7); }},
      {"from a link to itself",
       [](auto& m) { m.mutable_module_types(0)->mutable_joints(0)->set_link_a(2); }},
      {"connector 'c2': link 4294967295 of 3",
       [](auto& m) { m.mutable_module_types(0)->mutable_connectors(1)->set_link(~0u); }},
      {"not a unit vector",
       [](auto& m) {
         m.mutable_module_types(0)->mutable_joints(0)->mutable_direction_in_module()->set_x(1);
       }},
      {"is not finite",
       [&](auto& m) { m.mutable_module_types(0)->mutable_links(0)->mutable_hull(0)->set_x(nan); }},
      {"wrong way round",
       [&](auto& m) { m.mutable_module_types(0)->mutable_joints(0)->set_lower(nan); }},
      {"joint type", [](auto& m) { m.mutable_module_types(0)->mutable_joints(0)->clear_type(); }},
      {"two links are called",
       [](auto& m) { m.mutable_module_types(0)->mutable_links(0)->set_name("connecting_bar"); }},
      {"unit is not positive", [](auto& m) { m.mutable_module_types(0)->set_unit_m(0); }},
      {"has no values",
       [](auto& m) {
         m.mutable_module_types(0)->mutable_connectors(0)->mutable_states(1)->clear_values();
       }},
      {"module type 3 of 1", [](auto& m) { m.mutable_connection_types(0)->set_type_b(3); }},
      {"option 9: out of order",
       [](auto& m) { m.mutable_connection_types(0)->mutable_options(4)->set_number(9); }},
      {"8 entries in its rotation",
       [](auto& m) {
         m.mutable_connection_types(0)
             ->mutable_options(4)
             ->mutable_x_ab()
             ->mutable_rotation_row_major()
             ->RemoveLast();
       }},
      {"is not a rotation",
       [](auto& m) {  // a mirror image
         auto* X = m.mutable_connection_types(0)->mutable_options(4)->mutable_x_ab();
         for (int i = 0; i < 3; ++i) {
           X->set_rotation_row_major(i, -X->rotation_row_major(i));
         }
       }},
      {"no such state 'colour'",
       [](auto& m) {
         m.mutable_connection_types(0)->mutable_options(0)->mutable_states(0)->set_variable(
             "colour");
       }},
      {"no such state 'extended' or value of it",
       [](auto& m) {
         auto* option = m.mutable_connection_types(0)->mutable_options(0);
         option->mutable_other_states(1)->mutable_states(0)->mutable_value()->set_text("ajar");
       }},
      {"robot 'quadruped', connection 3: option 99 of 72",
       [](auto& m) { m.mutable_robots(0)->mutable_dockings(2)->set_option(99); }},
      {"the option is of other connectors",
       [](auto& m) { m.mutable_robots(0)->mutable_dockings(2)->set_connector_a(0); }},
      {"a connector used twice",
       [](auto& m) { *m.mutable_robots(0)->add_dockings() = m.robots(0).dockings(0); }},
      {"connected to itself",
       [](auto& m) { m.mutable_robots(0)->mutable_dockings(0)->set_module_b(0); }},
      {"1 start values for 2 joints",
       [](auto& m) { m.mutable_robots(0)->mutable_modules(0)->mutable_start()->RemoveLast(); }},
      {"root module 9 of 9", [](auto& m) { m.mutable_robots(0)->set_root_module(9); }},
      {"root link 3 of 3", [](auto& m) { m.mutable_robots(0)->set_root_link(3); }},
      {"no modules",
       [](auto& m) {
         m.mutable_robots(0)->clear_modules();
         m.mutable_robots(0)->clear_dockings();
       }},
      {"kinematic graph: body 77 of 18",
       [](auto& m) { m.mutable_robots(0)->mutable_graph()->mutable_joints(0)->set_body_a(77); }},
  };
  for (const auto& [expected, damage] : damages) {
    proto::Model bad = good;
    damage(bad);
    const Result<Model> result = FromProto(bad);
    ASSERT_FALSE(result.has_value()) << expected;
    EXPECT_NE(result.error().message.find(expected), std::string::npos) << result.error().message;
  }
}

TEST(ModelProto, SurvivesFlippedBytesAndCutTails) {
  const std::string bytes = SerializeModel(FullModel());
  std::mt19937 random(17);
  int read = 0;
  for (int round = 0; round < 1500; ++round) {
    std::string damaged = bytes;
    for (int flips = 1 + round % 3; flips > 0; --flips) {
      damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    }
    if (round % 10 == 0) damaged.resize(random() % damaged.size());
    const Result<Model> result = ParseModel(damaged);
    if (!result) continue;
    ++read;
    // What was read is sound enough to compute with.
    for (const Robot& robot : result->robots) BuildKinematicGraph(*result, robot);
  }
  EXPECT_GT(read, 0);
}

}  // namespace
}  // namespace morphbus::model
