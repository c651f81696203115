// Attributes of a model that settings change: which there are, what they may be, what is said of
// those that cannot be.
#include "compiler/model/attributes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "compiler/m3l/compile.h"
#include "compiler/model/model_proto.h"

namespace morphbus::model {
namespace {

/// A car whose units are 0.1 m, with a joint and a sensor of each kind, and a robot whose arm
/// starts at 0.5 rad.
Model MakeCar() {
  m3l::CompileOutput output = m3l::CompileText("car.m3l", R"(
    module CAR: unit=0.1
    link frame: hull=box(size=(2,2,2)), mass=2
    link arm: hull=box(size=(1,1,1), at=(5,0,0)), mass=0.5, friction=0.3
    link fork: hull=box(size=(1,1,1), at=(0,5,0)), mass=0.5
    link plate: hull=box(size=(1,1,1), at=(0,-5,0)), mass=0.5
    axis up: origin=(0,0,0), direction=(0,0,1)
    axis down: origin=(0,0,0), direction=(0,0,-1)
    joint turn: type=revolute, value=[-1,1], pair=((arm,up),(frame,down)), torque=1.5
    joint lift: type=prismatic, value=[0,2], pair=((fork,up),(frame,down)), speed=0.2
    joint weld: type=fixed, pair=((plate,up),(frame,down))
    sensor eye: type=distance, link=frame, origin=(1,0,0), direction=(1,0,0), range=8
    sensor level: type=tilt, link=frame, origin=(0,0,0), direction=(0,1,0)
    robot car: modules=(CAR c), joints=(c.turn=0.5)
  )");
  EXPECT_TRUE(output.model.has_value());
  return output.model.value_or(Model());
}

std::string ErrorOf(const std::string& name, const std::string& value) {
  Model model = MakeCar();
  const std::string before = SerializeModel(model);
  const Result<void> set = SetAttribute(&model, name, value);
  EXPECT_FALSE(set) << name << "=" << value;
  EXPECT_EQ(SerializeModel(model), before) << "a setting that failed changed the model";
  return set ? "" : set.error().message;
}

TEST(Attributes, SettingsAreInTheUnitsOfM3l) {
  Model model = MakeCar();
  for (const auto& [name, value] :
       std::vector<std::pair<std::string, std::string>>{{"turn.torque", "2.5"},
                                                        {"turn.speed", "180deg"},
                                                        {"turn.lower", "-90deg"},
                                                        {"turn.upper", "0.75rad"},
                                                        {"lift.upper", "3"},
                                                        {"lift.torque", "40"},
                                                        {"turn.backlash", "2deg"},
                                                        {"turn.delay", "20ms"},
                                                        {"lift.backlash", "0.05"},
                                                        {"arm.mass_spread", "5%"},
                                                        {"frame.mass", "3.5"},
                                                        {"frame.friction", "1.2"},
                                                        {"eye.range", "20"},
                                                        {"eye.noise", "0.5"},
                                                        {"level.noise", "1deg"}}) {
    const Result<void> set = SetAttribute(&model, "CAR." + name, value);
    ASSERT_TRUE(set) << set.error().message;
  }
  const ModuleType& type = model.module_types[0];
  EXPECT_EQ(type.joints[0].effort, 2.5);
  EXPECT_DOUBLE_EQ(type.joints[0].speed, std::numbers::pi);
  EXPECT_DOUBLE_EQ(type.joints[0].lower, -std::numbers::pi / 2);
  EXPECT_EQ(type.joints[0].upper, 0.75);
  EXPECT_DOUBLE_EQ(type.joints[1].upper, 0.3);
  EXPECT_EQ(type.joints[1].effort, 40.0);
  EXPECT_DOUBLE_EQ(type.joints[0].backlash, std::numbers::pi / 90);
  EXPECT_EQ(type.joints[0].delay_s, 0.02);
  EXPECT_DOUBLE_EQ(type.joints[1].backlash, 0.005);
  EXPECT_EQ(type.links[1].mass_spread, 0.05);
  EXPECT_EQ(type.links[0].mass_kg, 3.5);
  EXPECT_EQ(type.links[0].friction, 1.2);
  EXPECT_DOUBLE_EQ(type.sensors[0].range_m, 2.0);
  EXPECT_DOUBLE_EQ(type.sensors[0].noise, 0.05);
  EXPECT_DOUBLE_EQ(type.sensors[1].noise, std::numbers::pi / 180);
}

TEST(Attributes, EverySettableValueCanBeSetToWhatItIs) {
  Model model = MakeCar();
  for (const SettableAttribute& attribute : SettableAttributes(model)) {
    if (!attribute.value) continue;
    const Result<void> set = SetAttribute(&model, attribute.name, NumberText(*attribute.value));
    EXPECT_TRUE(set) << set.error().message;
  }
}

TEST(Attributes, TheListHasWhatAPartCanHave) {
  std::vector<std::string> names;
  for (const SettableAttribute& attribute : SettableAttributes(MakeCar())) {
    names.push_back(attribute.name);
  }
  const auto has = [&](const std::string& name) { return std::ranges::count(names, name) == 1; };
  EXPECT_TRUE(has("CAR.frame.mass"));
  EXPECT_TRUE(has("CAR.lift.lower"));
  EXPECT_TRUE(has("CAR.eye.range"));
  // A weld has no motor, and a tilt has no range.
  EXPECT_FALSE(has("CAR.weld.torque"));
  EXPECT_FALSE(has("CAR.weld.lower"));
  EXPECT_FALSE(has("CAR.level.range"));
}

TEST(Attributes, ValuesAndRangesOfTheListAreThoseOfTheUnit) {
  const std::vector<SettableAttribute> all = SettableAttributes(MakeCar());
  const auto of = [&](const std::string& name) {
    return *std::ranges::find_if(all, [&](const auto& a) { return a.name == name; });
  };
  EXPECT_EQ(of("CAR.eye.range").unit, "units of 0.1 m");
  EXPECT_DOUBLE_EQ(*of("CAR.eye.range").value, 8.0);
  EXPECT_DOUBLE_EQ(of("CAR.eye.range").most, 10000.0);
  EXPECT_EQ(of("CAR.turn.torque").unit, "N·m");
  EXPECT_EQ(of("CAR.lift.torque").unit, "N");
  EXPECT_EQ(of("CAR.lift.speed").unit, "m/s");
  EXPECT_EQ(of("CAR.arm.friction").value, 0.3);
  EXPECT_FALSE(of("CAR.frame.friction").value.has_value());
}

TEST(Attributes, ErrorsNameWhatThereIsAndWhatWasMeant) {
  EXPECT_EQ(ErrorOf("torque", "1"),
            "'torque' is no attribute: expected TYPE.PART.ATTRIBUTE, such as MTRAN.joint_1.torque");
  EXPECT_EQ(ErrorOf("CAB.turn.torque", "1"),
            "the model has no module type 'CAB' (did you mean 'CAR'?); it has CAR");
  EXPECT_EQ(ErrorOf("CAR.turm.torque", "1"),
            "CAR has no link, joint or sensor 'turm' (did you mean 'turn'?); it has frame, arm, "
            "fork, plate, turn, lift, weld, eye, level");
  EXPECT_EQ(ErrorOf("CAR.arm.mas", "1"),
            "link 'arm' of CAR has no attribute 'mas' that can be set (did you mean 'mass'?); it "
            "has mass, friction, mass_spread");
  EXPECT_EQ(ErrorOf("CAR.weld.torque", "1"),
            "joint 'weld' of CAR has no attribute 'torque' that can be set");
}

TEST(Attributes, ValuesOutOfRangeAreRefusedWithTheRange) {
  EXPECT_EQ(ErrorOf("CAR.turn.torque", "0"), "CAR.turn.torque: expected 1e-9 to 1e9 N·m, not '0'");
  EXPECT_EQ(ErrorOf("CAR.turn.torque", "strong"),
            "CAR.turn.torque: expected 1e-9 to 1e9 N·m, not 'strong'");
  EXPECT_EQ(ErrorOf("CAR.turn.speed", "-1"),
            "CAR.turn.speed: expected 1e-9 to 1e9 rad/s, or degrees with 'deg' behind them, not "
            "'-1'");
  EXPECT_EQ(ErrorOf("CAR.arm.mass", "0"),
            "CAR.arm.mass: expected above 0 and at most 1e9 kg, not '0'");
  EXPECT_EQ(ErrorOf("CAR.arm.friction", "10.5"), "CAR.arm.friction: expected 0 to 10, not '10.5'");
  EXPECT_EQ(ErrorOf("CAR.arm.friction", "1deg"), "CAR.arm.friction: expected 0 to 10, not '1deg'");
  EXPECT_EQ(ErrorOf("CAR.eye.range", "1e9"),
            "CAR.eye.range: expected 1e-5 to 10000 units of 0.1 m, not '1e9'");
}

TEST(Attributes, LimitsStayInOrderAndRoundTheStartValues) {
  EXPECT_EQ(ErrorOf("CAR.lift.lower", "2.5"),
            "CAR.lift.lower: the limits [2.5, 2] are the wrong way round");
  EXPECT_EQ(ErrorOf("CAR.turn.upper", "0.25"),
            "CAR.turn.upper: 'c.turn' of robot car starts at 0.5, outside the limits [-1, 0.25]");
  EXPECT_EQ(ErrorOf("CAR.lift.upper", "2e7"),
            "CAR.lift.upper: expected -1e7 to 1e7 units of 0.1 m, not '2e7'");
}

TEST(Attributes, WhatIsSetStandsInTheModelsHash) {
  Model model = MakeCar();
  const uint64_t before = ModelHash(SerializeModel(model));
  ASSERT_TRUE(SetAttribute(&model, "CAR.frame.friction", "0.9"));
  const std::string bytes = SerializeModel(model);
  EXPECT_NE(ModelHash(bytes), before);
  const Result<Model> again = ParseModel(bytes);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->module_types[0].links[0].friction, 0.9);
  EXPECT_FALSE(again->module_types[0].links[2].friction.has_value());
}

TEST(Attributes, AModelThatWasReadKeepsToTheRanges) {
  for (const auto& [name, most] : std::vector<std::pair<std::string, double>>{
           {"mass_spread", 0.3}, {"friction", 10.0}, {"backlash", 1.0}, {"delay", 1.0}}) {
    for (const double value : {-1e-3, most, most * 1.01}) {
      Model model = MakeCar();
      Link& link = model.module_types[0].links[0];
      Joint& joint = model.module_types[0].joints[0];
      if (name == "mass_spread") link.mass_spread = value;
      if (name == "friction") link.friction = value;
      if (name == "backlash") joint.backlash = value;
      if (name == "delay") joint.delay_s = value;
      const Result<Model> read = ParseModel(SerializeModel(model));
      EXPECT_EQ(read.has_value(), value == most) << name << " " << value;
    }
  }
}

}  // namespace
}  // namespace morphbus::model
