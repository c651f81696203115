// Sensors asked by where they look and by name, on the machine itself: which one answers, in which
// unit, and what is no answer. What they measure is set by hand.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "compiler/base/check.h"
#include "compiler/m3l/compile.h"
#include "test/support/compiled.h"
#include "test/support/vm_robot.h"
#include "vm/image/print_line.h"

namespace morphbus::vm {
namespace {

using test::VmRobot;

constexpr double kDegree = M_PI / 180;

/// Two types of one shape: EYED has sensors on its base and on a head that turns about up, DULL has
/// a sensor of touch alone, under a name that means a distance in EYED. `lying` is an EYED and
/// another behind it that lies on its side.
constexpr char kModel[] = R"(
module EYED: unit=0.1
point n: coords=(1,0,0), normal=(1,0,0), connector, k=1
point s: coords=(-1,0,0), normal=(-1,0,0), connector, k=2
link base: grouping=(n,s), hull=box(size=(2,2,2)), mass=1
link head: hull=box(size=(.5,.5,.5), at=(0,1.5,0)), mass=.1
axis up: origin=(0,0,0), direction=(0,1,0)
axis down: origin=(0,0,0), direction=(0,-1,0)
joint neck: type=revolute, value=[-pi,pi], pair=((head,up),(base,down)), torque=1
sensor front: type=distance, link=base, origin=(1,0,0), direction=(1,0,0), range=20
sensor slant: type=distance, link=base, origin=(1,0,0), direction=(1,1,0), range=20
sensor gaze: type=distance, link=head, origin=(0,0,0), direction=(0,0,1), range=20
sensor skin: type=contact, link=base, origin=(0,-1,0), direction=(0,-1,0)
sensor cheek: type=contact, link=head, origin=(0,0,0), direction=(0,-1,1)
sensor level: type=tilt, link=base, origin=(0,0,0), direction=(0,3,4)
module DULL: unit=0.1
point n: coords=(1,0,0), normal=(1,0,0), connector, k=1
link base: grouping=(n), hull=box(size=(2,2,2)), mass=1
link head: hull=box(size=(.5,.5,.5), at=(0,1.5,0)), mass=.1
axis up: origin=(0,0,0), direction=(0,1,0)
axis down: origin=(0,0,0), direction=(0,-1,0)
axis north: origin=(0,0,0), direction=(1,0,0)
joint neck: type=revolute, value=[-pi,pi], pair=((head,up),(base,down)), torque=1
sensor front: type=contact, link=base, origin=(0,0,0), direction=(1,0,0)
connection PLUG: members=(EYED a, EYED b), conditions=(a.point p coincident b.point q
  and p antiparallel q and a.up parallel b.up and p.k==2 and q.k==1)
connection SIDE: members=(EYED a, EYED b), conditions=(a.point p coincident b.point q
  and p antiparallel q and a.up parallel b.side and p.k==2 and q.k==1)
connection TAIL: members=(EYED a, DULL b), conditions=(a.point p coincident b.point q
  and p antiparallel q and a.up parallel b.up and p.k==2)
robot alone: modules=(EYED m1)
robot lying: modules=(EYED m1, EYED m2), connections=((m1.s, m2.n, SIDE:1))
robot unlike: modules=(EYED m1, DULL m2), connections=((m1.s, m2.n))
)";

model::Model Sensing() {
  std::string text = kModel;
  // The axis by which the second module of `lying` is laid down: what is its east is up.
  const std::string axis = "axis down: origin=(0,0,0), direction=(0,-1,0)\n";
  text.insert(text.find(axis), "axis side: origin=(0,0,0), direction=(0,0,1)\n");
  const m3l::CompileOutput output = m3l::CompileText("sensing.m3l", text);
  EXPECT_TRUE(output.model) << source::Render(output.diagnostics, output.sources, false);
  MORPHBUS_CHECK(output.model.has_value());
  return *output.model;
}

class SensorServicesTest : public ::testing::Test {
 protected:
  /// A robot whose modules all measure the same: 0.3, 0.5 and 0.7 m, no touch, and straight up
  /// along the y of the base.
  VmRobot& Run(const std::string& robot, const std::string& program) {
    model_ = Sensing();
    vms_ = std::make_unique<VmRobot>(model_, *model_.FindRobot(robot),
                                     test::ProgramFrom(program, model_));
    for (int m = 0; m < vms_->size(); ++m) vms_->sensors(m) = {0.3F, 0.5F, 0.7F, 0, 0, 0, 1, 0};
    return *vms_;
  }
  /// What module `m` prints in its startup routine, as a person reads it.
  std::string Printed(int m) {
    std::string printed;
    for (int i = 0; i < 40; ++i) {
      vms_->Tick();
      const StatusReport& status = vms_->output(m).status;
      for (int k = 0; k < status.num_prints; ++k) {
        const PrintReport& print = status.prints[k];
        // The text is empty, and a space lies between it and the values.
        printed +=
            PrintText(vms_->program(), nullptr, print.text, print.values, print.num_values) + ";";
      }
    }
    return printed.empty() ? printed : printed.substr(1);
  }
  /// The same, of a role of all modules that prints `values`.
  std::string Print(const std::string& robot, const std::string& values, int m = 0) {
    Run(robot, "role R extends Module { startup s() { print(" + values + "); } }");
    return Printed(m);
  }
  model::Model model_;
  std::unique_ptr<VmRobot> vms_;
};

TEST_F(SensorServicesTest, TheDistanceIsOfTheSensorThatLooksMostNearlyThere) {
  EXPECT_EQ(
      Print("alone", R"("", self.distance($NORTH), self.distance($UP), self.distance($EAST))"),
      "300 500 700;");
  EXPECT_EQ(Print("alone", R"("", self.distance($NORTH + $UP), self.distance($ANY))"), "500 300;")
      << "the slanted one looks exactly there; towards any the first one does";
}

TEST_F(SensorServicesTest, ASensorLooksWhereTheJointHasTurnedItsLink) {
  // By half a turn about up what looked east looks west.
  VmRobot& vms = Run("alone", R"(role R extends Module {
  startup s() {
    self.NECK.SET_POSITION(180);
    self.sleepds(30);
    print("", self.distance($WEST));
    print("", self.distance($EAST));
  }
})");
  std::string printed;
  for (int i = 0; i < 5; ++i) printed += Printed(0);
  EXPECT_EQ(printed, "700;");
  EXPECT_EQ(vms.CountFaults(FaultCode::kNoSensorThere), 1) << "none looks east any more";
}

TEST_F(SensorServicesTest, DirectionsAreThoseOfTheRobotHoweverAModuleLies) {
  // m2 lies on its side: its own east is up, and its up is west.
  EXPECT_EQ(Print("lying", R"("", self.distance($UP), self.distance($WEST))", 1), "700 500;");
  EXPECT_EQ(Print("lying", R"("", self.distance($UP), self.distance($EAST))", 0), "500 700;");
}

TEST_F(SensorServicesTest, AnyTouchedSensorThatLooksThereIsAContact) {
  VmRobot& vms = Run("alone", R"(role R extends Module {
  behavior b() {
    print("", self.contact($DOWN), self.contact($EAST), self.SKIN.GET_CONTACT());
    self.sleepcs(50);
  }
})");
  EXPECT_EQ(Printed(0).substr(0, 18), "false false false;");
  // Both look downwards; the second looks eastwards, too.
  vms.sensors(0)[4] = 1;
  EXPECT_EQ(Printed(0).substr(0, 16), "true true false;");
  vms.sensors(0)[4] = 0;
  vms.sensors(0)[3] = 1;
  EXPECT_EQ(Printed(0).substr(0, 16), "true false true;");
}

TEST_F(SensorServicesTest, TheTiltIsTheTurnOfTheRobotFrameAgainstGravity) {
  // A frame that is turned by an angle sees straight up turned by the same angle, the other way.
  const double turn = 30 * kDegree;
  const auto of = [&](double x, double y, double z) {
    Run("alone", R"(role R extends Module {
  startup s() {
    print("", round(self.tilt($EAST_WEST)), round(self.tilt($NORTH_SOUTH)), self.tilt($UP_DOWN));
  }
})");
    vms_->sensors(0)[5] = static_cast<float>(x);
    vms_->sensors(0)[6] = static_cast<float>(y);
    vms_->sensors(0)[7] = static_cast<float>(z);
    return Printed(0);
  };
  EXPECT_EQ(of(0, 1, 0), "0 0 0;");
  // About east, which is z, then about north, which is x.
  EXPECT_EQ(of(std::sin(turn), std::cos(turn), 0), "30 0 0;");
  EXPECT_EQ(of(0, std::cos(turn), -std::sin(turn)), "0 30 0;");
  EXPECT_EQ(of(0, -1, 0), "180 180 0;") << "upside down";
}

TEST_F(SensorServicesTest, ATiltSensorByNameTellsTheAngleBetweenItsDirectionAndUp) {
  // Its direction is (0, 0.6, 0.8).
  EXPECT_EQ(Print("alone", R"("", round(self.LEVEL.GET_TILT() * 100))"), "5313;");
  EXPECT_EQ(Print("alone", R"("", self.GAZE.GET_DISTANCE(), self.CHEEK.GET_CONTACT())"),
            "700 false;");
}

TEST_F(SensorServicesTest, WhereNoneLooksIsAFaultThatNamesTypeAndDirection) {
  VmRobot& vms = Run("alone", R"(role R extends Module {
  startup s() {
    print("", self.distance($WEST));
  }
})");
  EXPECT_EQ(Printed(0), "");
  ASSERT_EQ(vms.faults().size(), 1U);
  const Fault& fault = vms.faults()[0].fault;
  EXPECT_TRUE(fault.code == FaultCode::kNoSensorThere);
  EXPECT_EQ(fault.line, 3);
  EXPECT_NEAR(fault.direction_R.z, -1, 1e-6);
}

TEST_F(SensorServicesTest, ARoleThatNeedsASensorItsModuleLacksIsNotTaken) {
  // Of a kind, and by name.
  for (const std::string use : {"self.distance($NORTH)", "self.tilt($EAST_WEST)",
                                "self.LEVEL.GET_TILT()", "self.SKIN.GET_CONTACT()"}) {
    VmRobot& vms =
        Run("unlike", "role R extends Module { startup s() { print(\"\", " + use + "); } }");
    vms.Tick(40);
    EXPECT_EQ(vms.RoleOf(0), "R") << use;
    EXPECT_EQ(vms.RoleOf(1), "") << use;
    EXPECT_TRUE(vms.faults().empty()) << use;
  }
  // Both types feel.
  VmRobot& vms =
      Run("unlike", R"(role R extends Module { startup s() { print("", self.contact($ANY)); } })");
  vms.Tick(40);
  EXPECT_EQ(vms.RoleOf(1), "R");
}

TEST_F(SensorServicesTest, ANameThatMeansAnotherSensorInThisTypeIsAFault) {
  VmRobot& vms = Run("unlike", R"(role R extends Module {
  startup s() {
    print("", self.FRONT.GET_DISTANCE());
  }
})");
  EXPECT_EQ(Printed(0), "300;");
  ASSERT_EQ(vms.faults().size(), 1U);
  EXPECT_EQ(vms.faults()[0].module, 1);
  EXPECT_TRUE(vms.faults()[0].fault.code == FaultCode::kOtherSensor);
}

}  // namespace
}  // namespace morphbus::vm
