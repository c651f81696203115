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

/// A point of a module with its sub-points; coordinates in M (m).
struct PointSymbol {
  const PointDecl* decl = nullptr;
  std::optional<Eigen::Vector3d> p_M;
  std::vector<std::string> subpoint_names;
  std::vector<Eigen::Vector3d> subpoints;
  std::map<std::string, Eigen::Vector3d> normals;  ///< As Connector::normals.
  bool connector = false;
};

/// A named axis of a module, in M: origin (m), unit direction.
struct AxisSymbol {
  source::Span span;
  Eigen::Vector3d p_MoAo_M = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  bool valid = false;
};

/// A module type with the names that connections and robots may use.
struct CheckedModule {
  const ModuleDecl* decl = nullptr;
  model::ModuleType type;
  bool valid = false;  ///< No error in it; otherwise nothing is computed from it.
  std::map<std::string, PointSymbol> points;
  std::vector<std::map<std::string, PointSymbol>> link_points;  ///< Own points of each link.
  std::map<std::string, AxisSymbol> axes;
  std::map<std::string, source::Span> connector_spans;
  double extent_m = 0.0;  ///< Largest side of the box around all points.
};

/// Checks one module: names, coordinates, links, joints; masses and other defaults are filled in.
CheckedModule CheckModule(const ModuleDecl& decl, source::Diagnostics& diagnostics);

/// A connection whose names and types are checked, ready to be solved.
struct CheckedConnection {
  const ConnectionDecl* decl = nullptr;
  solver::ConnectionProblem problem;
  bool valid = false;
  /// Of the solved connection: the condition behind each of its rejections.
  std::vector<source::Span> broken;
};

/// Checks one connection against the modules; unsound modules silence what depends on them.
CheckedConnection CheckConnection(const ConnectionDecl& decl,
                                  const std::vector<CheckedModule>& modules,
                                  source::Diagnostics& diagnostics);

/// Options of solved connections by their pair of connectors.
class PairIndex {
 public:
  explicit PairIndex(const std::vector<model::ConnectionType>& connections);
  /// Indices into ConnectionType::options, by number; empty if the pair has none.
  [[nodiscard]] const std::vector<int>& Options(int connection, int connector_a,
                                                int connector_b) const;

 private:
  std::vector<std::map<std::pair<int, int>, std::vector<int>>> options_;
};

/// All that a robot is checked against. connections[i] describes model.connection_types[i].
struct RobotContext {
  const std::vector<CheckedModule>& modules;
  const std::vector<CheckedConnection>& connections;
  /// Module types and solved connections.
  const model::Model& model;
  const PairIndex& pairs;
};

/// Checks one robot; nothing if it has errors, or depends on a definition that has.
std::optional<model::Robot> CheckRobot(const RobotDecl& decl, const RobotContext& context,
                                       source::Diagnostics& diagnostics);

/// Index of the module type `name` in `modules`; absent: reported at `span` with the nearest name.
std::optional<int> FindModuleType(const std::string& name, const source::Span& span,
                                  const std::vector<CheckedModule>& modules,
                                  source::Diagnostics& diagnostics);

/// "did you mean 'x'?" or, if nothing is near, "known are a, b, c"; `what` names them: "links are".
std::string NameHint(const std::string& name, const std::vector<std::string>& candidates,
                     const std::string& what);

}  // namespace morphbus::m3l
