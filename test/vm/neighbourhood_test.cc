// What modules share with their neighbours, handlers with subjects and periods, printed lines: on
// whole robots of VMs.

#include <algorithm>
#include <set>

#include "test/vm/lone_module.h"
#include "vm/image/print_line.h"

namespace morphbus::vm {
namespace {

class NeighbourhoodTest : public LoneModuleTest {
 protected:
  /// A row of hinges from north to south; module 0 is the root.
  VmRobot& Row(int modules, const std::string& program, VmRobotOptions options = {}) {
    robot_ = test::ChainRobot(model_, modules);
    vms_ = std::make_unique<VmRobot>(model_, robot_, test::ProgramFrom(program, model_), options);
    return *vms_;
  }
  [[nodiscard]] Cell Field(int module, int slot) const {
    return vms_->state(module).role.fields[slot];
  }
};

constexpr char kCounters[] = R"(
abstract role Counter extends Module {
  hidden = 7;
  shared count = 0;
}
role First extends Counter {
  require self.C5.CONNECTED && !self.C0.CONNECTED;
  behavior b() { count += 1; }
}
role Second extends Counter {
  require self.C0.CONNECTED && self.C5.CONNECTED;
  shared extra = 2.5;
  seen = 0;
  behavior b() {
    if (self.connected($ANY, $First) == 1) seen = self.connected($ANY, $First).count;
  }
}
role Last extends Counter {
  require self.C0.CONNECTED && !self.C5.CONNECTED;
  seen = 0.0;
  behavior b() {
    if (self.connected($ANY, $Second) == 1) seen = self.connected($ANY, $Second).extra;
  }
}
)";

TEST_F(NeighbourhoodTest, SharedFieldsAreReadOneTickLate) {
  VmRobot& vms = Row(3, kCounters);
  vms.Tick(60);
  ASSERT_EQ(vms.RoleOf(1), "Second");
  for (int i = 0; i < 10; ++i) {
    const int32_t before = Field(0, 1).AsInt();
    vms.Tick();
    EXPECT_EQ(Field(1, 3).AsInt(), before);
    EXPECT_EQ(Field(0, 1).AsInt(), before + 1);
  }
  EXPECT_TRUE(vms.faults().empty());
  EXPECT_FLOAT_EQ(Field(2, 2).AsFloat(), 2.5f);
  // Nothing is told but what is shared.
  EXPECT_EQ(vms.output(0).message.num_shared, 1);
  EXPECT_EQ(vms.output(1).message.num_shared, 2);
}

TEST_F(NeighbourhoodTest, NotExactlyOneNeighbourIsAFault) {
  VmRobot& vms = Row(3, R"(
role Middle extends Module {
  require self.C0.CONNECTED && self.C5.CONNECTED;
  startup s() { self.sleepds(10); }
  behavior both() { self.sleepds(self.connected($ANY, $End).x); }
  behavior none() { self.sleepds(self.connected($ANY, $Middle).x); }
  shared x = 0;
}
role End extends Module {
  require self.connected == 1;
  shared x = 1;
}
)");
  vms.Tick(120);
  std::set<int> measured;
  for (const auto& event : vms.faults()) {
    EXPECT_TRUE(event.fault.code == FaultCode::kNotOneNeighbour);
    EXPECT_GT(event.fault.line, 0);
    measured.insert(static_cast<int>(event.fault.measured));
  }
  EXPECT_EQ(measured, (std::set<int>{0, 2}));
}

// A message may carry anything; what is no value of the field's type is not believed.
TEST_F(NeighbourhoodTest, WhatIsNoValueIsNotShared) {
  VmRobot& vms = Row(2, R"(
role A extends Module {
  require self.C5.CONNECTED;
  shared way = $UP;
}
role B extends Module {
  require self.C0.CONNECTED;
  seen = $NORTH;
  startup s() { self.sleepds(10); }
  behavior b() { seen = self.connected($ANY, $A).way; }
}
)");
  vms.Tick(100);
  EXPECT_TRUE(static_cast<Direction>(Field(1, 0).bits) == Direction::kUp);
  vms.state(0).role.fields[0] = Cell{99};
  vms.Tick(3);
  ASSERT_EQ(vms.faults().size(), 1u);
  EXPECT_TRUE(vms.faults()[0].fault.code == FaultCode::kNothingShared);
}

// Fields are numbers of one program; under the next one a neighbour has that one's first values.
TEST_F(NeighbourhoodTest, AfterASwitchOfProgramsNeighboursShareFirstValues) {
  VmRobot& vms = Row(3, kCounters);
  vms.Tick(60);
  const auto shared_role = [&vms](int connector) {
    return vms.state(1).neighbours[connector].shared_role;
  };
  EXPECT_EQ(shared_role(0), vms.RoleNamed("First"));
  EXPECT_EQ(shared_role(5), vms.RoleNamed("Last"));
  const auto next = test::ProgramFrom(
      "role Other extends Module { require self.connected == 9; shared a = $UP; }\n" +
          std::string(kCounters),
      model_);
  for (int m = 0; m < vms.size(); ++m) vms.ReplaceProgram(m, next);
  // The roles are one further in the new program, and counts begin at 0.
  EXPECT_EQ(shared_role(0), 2);
  EXPECT_EQ(shared_role(5), 4);
  EXPECT_EQ(vms.state(1).neighbours[0].shared[0].AsInt(), 0);
  vms.Tick(20);
  EXPECT_EQ(shared_role(0), 2);
  EXPECT_GT(vms.state(1).neighbours[0].shared[0].AsInt(), 10);
  EXPECT_TRUE(vms.faults().empty());
}

constexpr char kGossip[] = R"(
role Teller extends Module {
  require self.C5.CONNECTED && !self.C0.CONNECTED;
  handler tell() every 0.4 { self.connected($ANY, $Hearer).hear(2); }
}
role Hearer extends Module {
  require self.C0.CONNECTED;
  heard = 0;
  command hear(int n) { heard += n; }
}
)";

TEST_F(NeighbourhoodTest, ACommandForNeighboursRunsOnThemOnlyAndOnce) {
  for (const double loss : {0.0, 0.3}) {
    VmRobotOptions options;
    options.loss = loss;
    options.late = loss;
    options.grace_ticks = loss > 0 ? 20 : 0;
    VmRobot& vms = Row(4, kGossip, options);
    vms.Tick(400);
    // The timer has come every 20 ticks since the role was taken; the last ones may be under way.
    const int heard = Field(1, 0).AsInt() / 2;
    const auto issued = static_cast<int>(vms.state(0).diffusion.own_id);
    EXPECT_GE(issued, 15) << loss;
    EXPECT_LE(heard, issued) << loss;
    EXPECT_GE(heard, issued - 1) << loss;
    EXPECT_EQ(Field(2, 0).AsInt(), 0) << loss;
    EXPECT_EQ(Field(3, 0).AsInt(), 0) << loss;
  }
}

TEST_F(NeighbourhoodTest, AHandlerRunsForEachConnectorItsEventIsAbout) {
  VmRobot& vms = Row(3, R"(
role R extends Module {
  gone = 0; come = 0; waits = 0;
  handler on_disconnect(connector c) { if (!c.CONNECTED) gone += 1; self.sleepds(1); }
  handler on_connect() { come += 1; self.sleepds(1); }
}
)");
  vms.Tick(30);
  ASSERT_EQ(vms.RoleOf(1), "R");
  vms.SetDocked(0, false);
  vms.SetDocked(1, false);
  vms.Tick(15);
  EXPECT_EQ(Field(1, 0).AsInt(), 2);
  vms.SetDocked(0, true);
  vms.SetDocked(1, true);
  vms.Tick(15);
  EXPECT_EQ(Field(1, 1).AsInt(), 1);
}

TEST_F(NeighbourhoodTest, TimersRunAtTheirPeriods) {
  VmRobot& vms = Lone(R"(
  fast = 0; slow = 0; second = 0; tiny = 0;
  handler a() every 0.1 { fast += 1; }
  handler b() every 0.5 { slow += 1; }
  handler on_timer() { second += 1; }
  handler c() every 0.001 { tiny += 1; }
)");
  TakeRole();
  vms.Tick(100);  // 2 s.
  EXPECT_EQ(Field(0, 0).AsInt(), 20);
  EXPECT_EQ(Field(0, 1).AsInt(), 4);
  EXPECT_EQ(Field(0, 2).AsInt(), 2);
  EXPECT_EQ(Field(0, 3).AsInt(), 100);  // Once a tick at most.
}

TEST_F(NeighbourhoodTest, OnlyEarlyHandlersRunDuringStartup) {
  VmRobot& vms = Lone(R"(
  early_ones = 0; others = 0;
  startup s() { self.sleepds(20); }
  handler a() every 0.2 early { early_ones += 1; }
  handler b() every 0.2 { others += 1; }
)");
  TakeRole();
  vms.Tick(90);
  EXPECT_EQ(Field(0, 0).AsInt(), 9);
  EXPECT_EQ(Field(0, 1).AsInt(), 0);
  vms.Tick(30);
  EXPECT_GE(Field(0, 1).AsInt(), 2);
}

TEST_F(NeighbourhoodTest, PrintedLinesHaveTheirPlaceAndAreBounded) {
  VmRobot& vms = Lone(R"(startup s() {
    print("joint", self.TURN, "at", self.jointDegrees(self.TURN), $UP + $EAST, self.connected);
    for (var i = 0; i < 9; i += 1) print("number", i);
  })");
  vms.Tick();
  while (vms.output(0).status.num_prints == 0 && vms.tick() < 40) vms.Tick();
  const StatusReport& status = vms.output(0).status;
  ASSERT_EQ(status.num_prints, kMaxPrintsPerTick);
  EXPECT_EQ(status.prints_dropped, 10 - kMaxPrintsPerTick);
  EXPECT_TRUE(status.changed);
  EXPECT_EQ(status.prints[0].line, 3);
  EXPECT_EQ(status.prints[1].line, 4);
  const auto text = [&](int i) {
    const PrintReport& print = status.prints[i];
    return PrintText(vms.program(), nullptr, print.text, print.values, print.num_values);
  };
  EXPECT_EQ(text(0), "joint 0 at 0 $UP + $EAST 0");
  EXPECT_EQ(text(1), "number 0");
  EXPECT_EQ(text(3), "number 2");
  // A text of another program has no places for these values.
  EXPECT_EQ(PrintText(vms.program(), nullptr, 30000, status.prints[3].values, 1), "2");
  vms.Tick();
  EXPECT_EQ(vms.output(0).status.num_prints, 0);
}

}  // namespace
}  // namespace morphbus::vm
