#pragma once
// Roles without motion: which module of a robot that stands still takes which role, and why not.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/plan/run_plan.h"
#include "tools/roles/static_robot.h"
#include "vm/image/source_places.h"

namespace morphbus::tools {

/// Something that is wrong with a module's role.
struct RoleProblem {
  /// The whole on one line: "m1: not Knee: a requirement fails (walk.dyn:12: ...), measured 1
  /// against 2".
  std::string text;
  /// The same for who sees module and line beside it: "not Knee: this requirement fails, measured 1
  /// against 2".
  std::string brief;
  /// The place in the program's source that it speaks of; line 0 for none.
  vm::SourcePlace place;
};

/// What one module has settled on: a copy of names, which outlives the VMs.
struct StaticRole {
  /// The module's name in the robot.
  std::string module;
  std::string role;                           ///< Empty: none.
  std::map<std::string, std::string> labels;  ///< Label -> joint or link of the module.
  std::map<std::string, int> signs;           ///< Label (else joint) -> sign under setJointAxis.
  /// Why it plays no role, one a concrete role; faults that it reported otherwise.
  std::vector<RoleProblem> problems;
};

/// A role that could be taken, and that no module has taken.
struct UnplayedRole {
  std::string name;
  vm::SourcePlace place;  ///< Where the program declares it.
  /// The module that comes nearest to it: of those with a pose the first that meets most of what
  /// the role asks for, in the order in which the VM asks. Empty if none has a pose.
  std::string nearest;
  /// What that module fails at; without a text if it fits, and holds another role.
  RoleProblem lacks;
};

/// What all modules have settled on, or what they had when SettleRoles gave up waiting.
struct StaticRoles {
  std::string program_file;         ///< As the plan names it.
  std::vector<StaticRole> modules;  ///< In the robot's order.
  bool settled = false;             ///< False: roles still changed after `ticks`.
  /// Control ticks that the VMs ran.
  int64_t ticks = 0;
  /// In the order of their declarations.
  std::vector<UnplayedRole> unplayed;
  /// Places of the program that ask for the module's number, each once: what it does then is no
  /// longer the same for all robots of one configuration.
  std::vector<vm::SourcePlace> id_places;
};

/// What the modules of a plan's robot settle on (StaticRobot::Settle). Roles that never settle are
/// no error (`settled`). Fails as StaticRobot::Create does, whose `situation` this is; modules that
/// are silent have neither role nor problems.
Result<StaticRoles> SettleRoles(const RunPlan& plan, const Situation* situation = nullptr);

/// Whether the program has roles, also if all are abstract, so that no module can take any. False
/// for a damaged image.
bool HasRoles(const RunPlan& plan);

}  // namespace morphbus::tools
