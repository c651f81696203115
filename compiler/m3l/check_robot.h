#pragma once
// Parts of the robot checker that have files of their own. Internal to check_robot*.cc.

#include "compiler/m3l/checker.h"

namespace morphbus::m3l::internal {

/// Everything that the checking of one robot shares.
/// CheckRobot makes it (check_robot.cc) and hands it to the parts below, one after another; `robot`
/// and the tables grow as they go.
struct RobotScope {
  /// The definition that is checked.
  const RobotDecl& decl;
  /// The modules and connections that it may use.
  const RobotContext& context;
  source::Diagnostics& diagnostics;
  /// What has been made of the definition so far.
  model::Robot robot;
  /// The index of each module of the robot, by its name.
  std::map<std::string, int> module_index;
  /// The place of the name of each module, in the order of robot.modules.
  std::vector<source::Span> module_spans;
  /// Some module is missing only because its entry is wrong; names may then be unknown for that.
  bool names_lost = false;
  /// The place of each entry of robot.dockings, in the same order.
  std::vector<source::Span> docking_spans;
  /// Modules that entries of `connections` join, also those entries that have errors.
  std::vector<std::pair<int, int>> edges;
  /// Where each connector is used: (module, connector).
  std::map<std::pair<int, int>, source::Span> used;

  /// Type and name of module number `module` of the robot.
  [[nodiscard]] const model::ModuleType& TypeOf(int module) const {
    const int type = robot.modules[module].type;
    return context.model.module_types[type];
  }
  [[nodiscard]] const std::string& NameOf(int module) const { return robot.modules[module].name; }
};

/// Index of the module called `name`; reported if there is none.
std::optional<int> FindModule(const Name& name, const RobotScope& scope);

/// Reports that a module type has no `what` of that name, with the nearest of `names`, which
/// `listing` introduces. Silent where the type has errors: what it lacks may be what did not parse.
void ReportNoMember(const CheckedModule& module, const std::string& what, const Name& name,
                    const std::vector<std::string>& names, const std::string& listing,
                    source::Diagnostics& diagnostics);

/// One entry of `connections` (check_docking.cc).
void CheckDocking(const Expr& entry, RobotScope& scope);

/// The `frame`, or the default one (check_frame.cc).
void CheckFrame(const Expr* frame, RobotScope& scope);

/// Modules that hang off nothing (check_assembly.cc).
void CheckConnected(RobotScope& scope);
/// Loops that do not close, hulls in each other (check_assembly.cc); for a robot without errors.
void CheckGeometry(RobotScope& scope);

}  // namespace morphbus::m3l::internal
