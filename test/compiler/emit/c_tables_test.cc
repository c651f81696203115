// The tables of a module type in C, compiled and loaded: what they hold is what the kinematics
// image holds, and virtual machines that stand on them do what those on images do.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "compiler/emit/back_ends.h"
#include "compiler/emit/kinematics.h"
#include "test/compiler/emit/compiled_c.h"
#include "test/compiler/emit/exported_robots.h"
#include "test/support/compiled.h"
#include "test/support/vm_robot.h"
#include "vm/image/kinematics_tables.h"
#include "vm/image/kinematics_verifier.h"

namespace morphbus::emit {
namespace {

using test::CompiledC;

constexpr uint64_t kModelHash = 0xfedcba9876543210u;

std::string ToString(const vm::Text& text) { return {text.data, text.size}; }

/// A module type's tables, compiled.
class Tables {
 public:
  Tables(const model::Model& model, int type)
      : compiled_(ModuleToC(model, type, kModelHash, "module"), "module"),
        all_(static_cast<const morphbus_kinematics*>(
            compiled_.Find(model.module_types[static_cast<size_t>(type)].name + "_kinematics"))) {}
  [[nodiscard]] const morphbus_kinematics* all() const { return all_; }

 private:
  CompiledC compiled_;
  const morphbus_kinematics* all_;
};

void ExpectSame(const vm::Vec3& a, const vm::Vec3& b) {
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.z, b.z);
}

void ExpectSameJoint(const vm::KinJoint& a, const vm::KinJoint& b) {
  EXPECT_EQ(ToString(a.name), ToString(b.name));
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.link_a, b.link_a);
  EXPECT_EQ(a.link_b, b.link_b);
  ExpectSame(a.origin_m, b.origin_m);
  ExpectSame(a.axis, b.axis);
  EXPECT_EQ(a.lower_rad, b.lower_rad);
  EXPECT_EQ(a.upper_rad, b.upper_rad);
  EXPECT_EQ(a.speed_rad_s, b.speed_rad_s);
}

void ExpectSameConnector(const vm::KinConnector& a, const vm::KinConnector& b) {
  EXPECT_EQ(ToString(a.name), ToString(b.name));
  EXPECT_EQ(a.link, b.link);
  ASSERT_EQ(a.num_states, b.num_states);
  for (int s = 0; s < a.num_states; ++s) {
    EXPECT_EQ(ToString(a.states[s].name), ToString(b.states[s].name));
    EXPECT_EQ(a.states[s].num_values, b.states[s].num_values);
  }
}

void ExpectSameConnection(const vm::KinConnection& a, const vm::KinConnection& b) {
  EXPECT_EQ(a.connection_type, b.connection_type);
  EXPECT_EQ(a.number, b.number);
  EXPECT_EQ(a.connector, b.connector);
  EXPECT_EQ(a.mate_connector, b.mate_connector);
  EXPECT_EQ(a.is_member_b, b.is_member_b);
  ExpectSame(a.X_MN.p, b.X_MN.p);
  const vm::Quat& p = a.X_MN.q;
  const vm::Quat& q = b.X_MN.q;
  EXPECT_TRUE(p.w == q.w && p.x == q.x && p.y == q.y && p.z == q.z);
}

void ExpectSame(const vm::VerifiedKinematics& a, const vm::VerifiedKinematics& b) {
  EXPECT_EQ(a.hash(), b.hash());
  EXPECT_EQ(a.model_hash(), b.model_hash());
  EXPECT_EQ(ToString(a.type_name()), ToString(b.type_name()));
  ASSERT_EQ(a.num_links(), b.num_links());
  for (int i = 0; i < a.num_links(); ++i) {
    EXPECT_EQ(ToString(a.link(i).name), ToString(b.link(i).name));
    EXPECT_EQ(a.BodyLink(i), b.BodyLink(i));
  }
  ASSERT_EQ(a.num_joints(), b.num_joints());
  for (int i = 0; i < a.num_joints(); ++i) ExpectSameJoint(a.joint(i), b.joint(i));
  ASSERT_EQ(a.num_connectors(), b.num_connectors());
  for (int i = 0; i < a.num_connectors(); ++i) ExpectSameConnector(a.connector(i), b.connector(i));
  ASSERT_EQ(a.num_connections(), b.num_connections());
  for (int i = 0; i < a.num_connections(); ++i) {
    ExpectSameConnection(a.connection(i), b.connection(i));
  }
}

/// The models of all robots that the back ends are tried on, one of each.
std::vector<model::Model> Models() {
  std::vector<model::Model> models;
  std::vector<std::string> seen;
  for (test::ExportCase& robot : test::ExportCases(0)) {
    std::string types;
    for (const model::ModuleType& type : robot.model.module_types) types += type.name + " ";
    if (std::find(seen.begin(), seen.end(), types) != seen.end()) continue;
    seen.push_back(types);
    models.push_back(std::move(robot.model));
  }
  return models;
}

TEST(CTables, TablesHoldWhatTheImageHoldsOfEveryModuleType) {
  size_t types = 0;
  for (const model::Model& model : Models()) {
    for (size_t t = 0; t < model.module_types.size(); ++t, ++types) {
      SCOPED_TRACE(model.module_types[t].name);
      const Tables tables(model, static_cast<int>(t));
      ASSERT_NE(tables.all(), nullptr);
      vm::VerifiedKinematics from_tables;
      ASSERT_EQ(vm::VerifyTables(*tables.all(), &from_tables).message, nullptr);
      const Result<std::string> image = KinematicsImage(model, static_cast<int>(t), kModelHash);
      ASSERT_TRUE(image.has_value());
      vm::VerifiedKinematics from_image;
      ASSERT_EQ(vm::VerifyKinematics(reinterpret_cast<const uint8_t*>(image->data()),
                                     static_cast<uint32_t>(image->size()), &from_image)
                    .message,
                nullptr);
      ExpectSame(from_tables, from_image);
    }
  }
  EXPECT_GE(types, 6u);  // M-TRAN, the gadget, ATRON, CKBot, Molecube, the telescope.
}

TEST(CTables, TablesHoldTheFeaturesOfTheConnectors) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const Tables tables(model, 0);
  ASSERT_NE(tables.all(), nullptr);
  ASSERT_EQ(tables.all()->num_connectors, 6);
  for (size_t c = 0; c < 6; ++c) {
    const morphbus_connector& connector = tables.all()->connectors[c];
    const model::Connector& expected = model.module_types[0].connectors[c];
    ASSERT_EQ(connector.num_points, expected.subpoints.size());
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(connector.centre[k], static_cast<float>(expected.p_MoCo_M[k]));
      for (size_t p = 0; p < expected.subpoints.size(); ++p) {
        EXPECT_EQ(connector.points[p][k], static_cast<float>(expected.subpoints[p][k]));
      }
    }
  }
}

TEST(CTables, AVirtualMachineOnTablesDoesWhatOneOnAnImageDoes) {
  for (const char* file : {"models/mtran.m3l", "models/mixed.m3l"}) {
    const model::Model model = test::ModelFrom(file);
    const std::vector<uint8_t> program =
        test::ProgramFrom(test::TextOf("models/programs/quadruped.dyn"), model);
    std::vector<std::unique_ptr<Tables>> tables;
    test::VmRobotOptions options;
    for (size_t t = 0; t < model.module_types.size(); ++t) {
      tables.push_back(std::make_unique<Tables>(model, static_cast<int>(t)));
      ASSERT_NE(tables.back()->all(), nullptr);
      options.tables.push_back(tables.back()->all());
    }
    const model::Robot& robot = model.robots.front();
    test::VmRobot on_images(model, robot, program);
    test::VmRobot on_tables(model, robot, program, options);
    bool moved = false;
    for (int tick = 0; tick < 600; ++tick) {
      on_images.Tick();
      on_tables.Tick();
      for (int m = 0; m < on_images.size(); ++m) {
        const vm::TickOutput& a = on_images.output(m);
        const vm::TickOutput& b = on_tables.output(m);
        ASSERT_EQ(a.status.role, b.status.role);
        ASSERT_EQ(a.status.num_faults, b.status.num_faults);
        ASSERT_EQ(a.message.num_links, b.message.num_links);
        for (int l = 0; l < a.message.num_links; ++l) {
          ExpectSame(a.message.X_RL[l].p, b.message.X_RL[l].p);
        }
        for (int j = 0; j < vm::kMaxJoints; ++j) {
          ASSERT_EQ(a.joints[j].mode, b.joints[j].mode);
          ASSERT_EQ(a.joints[j].target, b.joints[j].target);
          moved = moved || a.joints[j].target != 0.0;
        }
      }
    }
    EXPECT_TRUE(moved) << file;
  }
}

TEST(CTables, AModuleBeyondTheMachineGetsNoTablesAndAWarning) {
  model::Model model = test::ModelFrom("models/mtran.m3l");
  while (model.module_types[0].links.size() < 40) {
    model.module_types[0].links.push_back(model.module_types[0].links[0]);
  }
  const Exported exported = ModuleToC(model, 0, 0, "module");
  EXPECT_EQ(exported.text.find("morphbus_kinematics"), std::string::npos);
  ASSERT_EQ(exported.warnings.size(), 1u);
  EXPECT_NE(exported.warnings[0].find("40 links"), std::string::npos) << exported.warnings[0];
  EXPECT_EQ(exported.companions.size(), 1u);
}

TEST(CTables, AModulesHeaderIsKeptWhereItIsCalledLikeTheTypes) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const Exported exported = ModuleToC(model, 0, 0, "morphbus_kinematics");
  ASSERT_EQ(exported.companions.size(), 2u);
  EXPECT_NE(exported.companions[0].path, exported.companions[1].path);
  const CompiledC compiled(exported, "morphbus_kinematics");
  EXPECT_NE(compiled.Find("MTRAN_kinematics"), nullptr);
}

TEST(CTables, AModuleCalledMorphbusKeepsItsTablesApartFromTheirType) {
  model::Model model = test::ModelFrom("models/mtran.m3l");
  model.module_types[0].name = "morphbus";
  const CompiledC compiled(ModuleToC(model, 0, 0, "module"), "module");
  EXPECT_NE(compiled.Find("morphbus__kinematics"), nullptr);
  EXPECT_NE(compiled.Find("morphbus__forward_kinematics"), nullptr);
}

/// Tables that can be damaged.
struct Copy {
  explicit Copy(const morphbus_kinematics& from)
      : links(from.links, from.links + from.num_links),
        joints(from.joints, from.joints + from.num_joints),
        connectors(from.connectors, from.connectors + from.num_connectors),
        connections(from.connections, from.connections + from.num_connections),
        all(from) {
    all.links = links.data();
    all.joints = joints.data();
    all.connectors = connectors.data();
    all.connections = connections.data();
  }
  Copy(const Copy&) = delete;
  Copy& operator=(const Copy&) = delete;

  std::vector<morphbus_link> links;
  std::vector<morphbus_joint> joints;
  std::vector<morphbus_connector> connectors;
  std::vector<morphbus_connection> connections;
  morphbus_kinematics all;
};

TEST(CTables, DamagedTablesAreRefused) {
  const model::Model model = test::ModelFrom("models/mtran.m3l");
  const Tables tables(model, 0);
  ASSERT_NE(tables.all(), nullptr);
  const std::string long_name(256, 'x');
  const morphbus_state no_values = {"hooks", 0};
  struct Damage {
    const char* message;
    std::function<void(Copy*)> apply;
  };
  const std::vector<Damage> damages = {
      {"number of links", [](Copy* c) { c->all.num_links = 0; }},
      {"too many joints", [](Copy* c) { c->all.num_joints = 9; }},
      {"too many connectors", [](Copy* c) { c->all.num_connectors = 25; }},
      {"name is empty or too long", [](Copy* c) { c->links[1].name = ""; }},
      {"name is empty or too long", [](Copy* c) { c->links[1].name = nullptr; }},
      {"name is empty or too long", [&](Copy* c) { c->all.type_name = long_name.c_str(); }},
      {"joint kind is unknown", [](Copy* c) { c->joints[0].kind = 4; }},
      {"joint does not connect two links", [](Copy* c) { c->joints[0].link_a = 3; }},
      {"number is not finite", [](Copy* c) { c->joints[1].upper = INFINITY; }},
      {"joint axis is not a unit vector", [](Copy* c) { c->joints[1].axis[0] = 1.0f; }},
      {"joint limits are the wrong way round", [](Copy* c) { c->joints[1].lower = 3.0f; }},
      {"joint speed is not positive", [](Copy* c) { c->joints[1].speed = 0.0f; }},
      {"connector sits on no link", [](Copy* c) { c->connectors[2].link = 3; }},
      {"connector has too many states", [](Copy* c) { c->connectors[2].num_states = 5; }},
      {"state has no values",
       [&](Copy* c) {
         c->connectors[0].states = &no_values;
         c->connectors[0].num_states = 1;
       }},
      {"array is missing", [](Copy* c) { c->all.links = nullptr; }},
      {"array is missing", [](Copy* c) { c->all.joints = nullptr; }},
      {"array is missing", [](Copy* c) { c->all.connectors = nullptr; }},
      {"array is missing", [](Copy* c) { c->all.connections = nullptr; }},
      {"array is missing", [](Copy* c) { c->connectors[0].states = nullptr; }},
      {"array is missing", [](Copy* c) { c->connectors[0].points = nullptr; }},
      {"connection names no connector", [](Copy* c) { c->connections[7].connector = 6; }},
      {"connection numbers begin at 1", [](Copy* c) { c->connections[7].number = 0; }},
      {"transform of a connection is not a pose", [](Copy* c) { c->connections[7].q[0] = 2.0f; }},
      {"connections are not in order", [](Copy* c) { c->connections[7] = c->connections[6]; }},
  };
  for (const Damage& damage : damages) {
    Copy copy(*tables.all());
    damage.apply(&copy);
    vm::VerifiedKinematics kinematics;
    const vm::VerifyError error = vm::VerifyTables(copy.all, &kinematics);
    ASSERT_NE(error.message, nullptr) << damage.message;
    EXPECT_STREQ(error.message, damage.message);
    EXPECT_EQ(kinematics.num_links(), 0);
  }
}

}  // namespace
}  // namespace morphbus::emit
