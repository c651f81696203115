#pragma once
// The checker: syntax trees to the parts of a Model. Split by definition: check_module.cc,
// check_connection.cc, check_robot.cc and their helpers. Internal to the M3L compiler.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compiler/m3l/ast.h"
#include "compiler/model/robot_model.h"
#include "compiler/solver/connection_problem.h"

namespace morphbus::m3l {

/// A point of a module with its sub-points, as CheckPoint makes it. Coordinates are in the module
/// frame M (m).
struct PointSymbol {
  const PointDecl* decl = nullptr;
  /// The position of the point; absent if it has no sound `coords`.
  std::optional<Eigen::Vector3d> p_M;
  std::vector<std::string> subpoint_names;
  /// The positions of the sub-points, in the order of their names.
  std::vector<Eigen::Vector3d> subpoints;
  /// Unit directions in M by sub-point name, the key "" for the point itself (Connector::normals).
  std::map<std::string, Eigen::Vector3d> normals;
  /// True if the point is flagged as a place where modules are mated.
  bool connector = false;
};

/// A named axis of a module, in the module frame M.
struct AxisSymbol {
  /// The place of its name.
  source::Span span;
  /// A point on the axis, as `origin` gives it (m).
  Eigen::Vector3d p_MoAo_M = Eigen::Vector3d::Zero();
  /// The direction about which positive joint values turn, right-handed; a unit vector.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  /// False after an error; the axis is then of no use.
  bool valid = false;
};

/// A module type with the names that connections and robots may use.
/// The compiler keeps it until all robots are checked.
struct CheckedModule {
  const ModuleDecl* decl = nullptr;
  model::ModuleType type;
  /// True if the module has no error; otherwise nothing is computed from it.
  bool valid = false;
  /// The points of the module itself, by name.
  std::map<std::string, PointSymbol> points;
  /// For each link of `type`: the points that belong to it alone, by name.
  std::vector<std::map<std::string, PointSymbol>> link_points;
  /// The axes that joints and frames may name.
  std::map<std::string, AxisSymbol> axes;
  /// For each connector of `type` the directions that conditions may compare: its normals, and
  /// where no connector of the module has one at that point, what stands in for it: for the centre
  /// the way out, for a sub-point the way to it from the centre.
  std::vector<std::map<std::string, Eigen::Vector3d>> directions;
  /// Where each connector is declared, by its name.
  std::map<std::string, source::Span> connector_spans;
  /// The largest side of the box around all points (m), to which tolerances are relative.
  double extent_m = 0.0;
};

/// Checks one module: names, coordinates, links, joints. Masses and other defaults are filled in.
/// Meshes that it names are read from beside the file, among `sources`, that names them.
/// Errors go to `diagnostics`; the result then has valid = false and holds what could be made out.
CheckedModule CheckModule(const ModuleDecl& decl, const source::SourceSet& sources,
                          source::Diagnostics* diagnostics);

/// A connection whose names and types are checked, ready to be solved.
/// `decl` is part of the syntax tree and must outlive the result.
struct CheckedConnection {
  const ConnectionDecl* decl = nullptr;
  solver::ConnectionProblem problem;
  /// True if there is no error in it, in its members, or in its solving.
  bool valid = false;
  /// Of the solved connection: the condition behind each of its rejections.
  std::vector<source::Span> broken;
};

/// Checks one connection against the modules. Where a module is unsound, what depends on it is not
/// reported once more; the result is then not valid.
CheckedConnection CheckConnection(const ConnectionDecl& decl,
                                  const std::vector<CheckedModule>& modules,
                                  source::Diagnostics* diagnostics);

/// For each solved connection: indices into ConnectionType::options, by number, of each pair of
/// connectors (of a, of b) that has any.
using PairIndex = std::vector<std::map<std::pair<int, int>, std::vector<int>>>;

/// All that a robot is checked against. connections[i] describes model.connection_types[i].
struct RobotContext {
  const std::vector<CheckedModule>& modules;
  const std::vector<CheckedConnection>& connections;
  /// Module types and solved connections.
  const model::Model& model;
  const PairIndex& pairs;
};

/// A robot, and where it is written.
struct CheckedRobot {
  model::Robot robot;
  /// The place of the name of each module, in the order of robot.modules.
  std::vector<source::Span> modules;
  /// The place of each entry of `connections`, in the order of robot.dockings.
  std::vector<source::Span> dockings;
};

/// Checks one robot: modules, connections, frame, start values, then whether loops close and
/// modules lie in each other. Returns nothing if it has errors, or depends on a definition that
/// has.
std::optional<CheckedRobot> CheckRobot(const RobotDecl& decl, const RobotContext& context,
                                       source::Diagnostics* diagnostics);

/// The names of items: of structs that have one, or of the keys of a map.
template <typename Items>
std::vector<std::string> NamesOf(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) {
    if constexpr (requires { item.first; }) {
      names.push_back(item.first);
    } else {
      names.push_back(item.name);
    }
  }
  return names;
}

/// Index of the module type `name` in `modules`; absent: reported at `span` with the nearest name.
std::optional<int> FindModuleType(const std::string& name, const source::Span& span,
                                  const std::vector<CheckedModule>& modules,
                                  source::Diagnostics* diagnostics);

/// "did you mean 'x'?" or, if nothing is near, "known are a, b, c"; `what` names them: "links are".
std::string NameHint(const std::string& name, const std::vector<std::string>& candidates,
                     const std::string& what);

}  // namespace morphbus::m3l
