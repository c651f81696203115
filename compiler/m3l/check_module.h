#pragma once
// Parts of the module checker that have files of their own. Internal to check_module*.cc.

#include "compiler/m3l/checker.h"

namespace morphbus::m3l::internal {

/// Largest coordinate (m) that is accepted: beyond it, squares of distances lose the micrometres.
constexpr double kMaxCoordinate_m = 1e6;

/// Everything that the checking of one module shares.
/// CheckModule makes it (check_module.cc) and hands it to the parts below, one after another.
struct ModuleScope {
  CheckedModule& module;
  source::Diagnostics& diagnostics;
  /// Metres per model unit: the module's `unit`.
  double unit_m = 1.0;
  /// Some name may be missing only because its declaration did not parse.
  bool names_lost = false;
  /// link_of[point name]: link that groups a module-level point, and where.
  std::map<std::string, std::pair<int, source::Span>> link_of;
};

/// A vector in model units, in metres; reports what is too far away.
std::optional<Eigen::Vector3d> EvaluatePoint(const Expr& expr, const std::string& what,
                                             const ModuleScope& scope);

/// Coordinates, sub-points and normals of one point (check_point.cc).
PointSymbol CheckPoint(const PointDecl& decl, const ModuleScope& scope);

/// The connector that `symbol` is, carried by `link` (check_point.cc).
model::Connector MakeConnector(const PointSymbol& symbol, int link, const ModuleScope& scope);

/// Groupings, hulls and masses of all links (check_link.cc). Points are known already.
void CheckLinks(ModuleScope& scope);

/// Axes and joints (check_joint.cc). Links are known already.
void CheckAxesAndJoints(ModuleScope& scope);

/// An axis from its `origin` and `direction` (m, unit); not valid if there is an error
/// (check_joint.cc). Also used for the anonymous axes of a robot's frame.
AxisSymbol CheckAxis(const Declaration& decl, const std::string& what, double unit_m,
                     source::Diagnostics* diagnostics);

}  // namespace morphbus::m3l::internal
