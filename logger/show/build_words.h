#pragma once
// What a sheet says of how a robot is put together (compiler/model/assembly_plan.h), in words that
// a person can check on the modules in hand.

#include <string>
#include <vector>

#include "compiler/model/assembly_plan.h"

namespace morphbus::logger {

/// A robot and the plan for it; all three outlive what refers to them.
struct Assembly {
  const model::Model& model;
  const model::Robot& robot;
  const model::AssemblyPlan& plan;

  [[nodiscard]] const model::ModuleType& TypeOf(int module) const {
    return model.TypeOf(robot, module);
  }
  /// "m2".
  [[nodiscard]] const std::string& NameOf(int module) const { return robot.modules[module].name; }
  /// "m2.c3".
  [[nodiscard]] std::string EndOf(int module, int connector) const {
    return NameOf(module) + "." + TypeOf(module).connectors[connector].name;
  }
};

/// A direction in the robot frame: "up", "north and up".
std::string DirectionWords(const Eigen::Vector3d& direction_R);
/// "a quarter turn anticlockwise", "half a turn", "a turn of 50° clockwise".
std::string TurnWords(const model::MatingTurn& turn);
/// A joint's value as it is set: "-45°", "32.5 mm".
std::string ValueWords(const model::Joint& joint, double value);
/// "a", "a and b", "a, b and c".
std::string ListWords(const std::vector<std::string>& words);

/// To which values the joints of a module are set; nothing if it has none.
std::vector<std::string> JointLines(const Assembly& assembly, int module,
                                    const std::vector<double>& values);
/// How the first module lies.
std::string LyingLine(const Assembly& assembly, int module);
/// How the module is put on. The matings have the numbers `first_mark` (of the standing connector)
/// and the one behind it (of the own), and so on in the step's picture.
std::vector<std::string> MatingLines(const Assembly& assembly, const model::AddedModule& added,
                                     int first_mark);
/// Which way round, by what then can be seen: a line each, of one mating.
std::vector<std::string> WayLines(const Assembly& assembly, int module,
                                  const model::Mating& mating);

}  // namespace morphbus::logger
