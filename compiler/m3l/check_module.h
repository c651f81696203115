#pragma once
// Parts of the module checker that have files of their own. Internal to check_module*.cc.

#include "compiler/m3l/checker.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/model/attributes.h"

namespace morphbus::m3l::internal {

/// Largest coordinate (m) that is accepted: beyond it, squares of distances lose the micrometres.
constexpr double kMaxCoordinate_m = 1e6;

/// Everything that the checking of one module shares.
/// CheckModule makes it (check_module.cc) and hands it to the parts below, one after another.
struct ModuleScope {
  CheckedModule& module;
  /// The files of the compilation, for paths that are relative to them.
  const source::SourceSet& sources;
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

/// Groupings, hulls and masses of all links (check_link.cc), and from all points the module's
/// extent. Points and axes are known already.
void CheckLinks(ModuleScope& scope);

/// The points of a convex part of a hull, in M (m), that is written as box, cylinder, sphere or
/// mesh (check_shape.cc); nothing after an error.
std::optional<std::vector<Eigen::Vector3d>> CheckShape(const Expr& call, ModuleScope& scope);
/// Whether a call of this name is such a part.
bool IsShape(const std::string& function);

/// The triangles of `mesh("part.stl")` in `visual`, an STL, OBJ or glTF file, in M
/// (check_visual.cc); nothing after an error.
std::optional<model::VisualPart> CheckVisualMesh(const Expr& call, ModuleScope& scope);
/// Takes `colour=...` out of the arguments of a shape; nothing if it has none.
std::optional<Expr> TakeColour(Expr* call, ModuleScope& scope);
/// The colour that is written as "#4d78a8"; nothing after an error.
std::optional<Color> CheckColour(const Expr& expr, ModuleScope& scope);
/// The path of a mesh file that `name` gives relative to the file in which it stands; nothing after
/// an error (check_shape.cc).
std::optional<std::string> MeshPath(const Expr& call, ModuleScope& scope);

/// Reads a numeric attribute of a part, if it stands there, in the unit that its module and its
/// kind of part give it; reports what is out of the attribute's range.
template <class Part>
void CheckNumber(const model::NumericAttribute<Part>& attribute, ModuleScope& scope,
                 AttributeReader* attributes, Part* part) {
  const Expr* expr = attributes->Optional(std::string(attribute.name));
  const auto value = expr ? EvaluateNumber(*expr, &scope.diagnostics) : std::nullopt;
  if (!value) return;
  const model::Unit unit = model::UnitOf(attribute.measure, *part, scope.unit_m);
  const double si = *value * unit.si;
  if (!attribute.Allows(si)) {
    scope.diagnostics.Error(expr->span, "'" + std::string(attribute.name) + "' is " +
                                            model::RangeText(attribute, *part));
  } else if (HasAngle(*expr) && !unit.angle) {
    scope.diagnostics.Error(expr->span,
                            "'" + std::string(attribute.name) + "' is no angle, and this is one");
  } else {
    attribute.set(part, si);
  }
}

/// All axes (check_joint.cc).
void CheckAxes(ModuleScope& scope);
/// All joints (check_joint.cc). Axes and links are known already.
void CheckJoints(ModuleScope& scope);
/// All sensors (check_sensor.cc). Links are known already.
void CheckSensors(ModuleScope& scope);

/// An axis from its `origin` and `direction` (m, unit); not valid if there is an error
/// (check_joint.cc). Also used for the anonymous axes of a robot's frame.
AxisSymbol CheckAxis(const Declaration& decl, const std::string& what, double unit_m,
                     source::Diagnostics* diagnostics);

}  // namespace morphbus::m3l::internal
