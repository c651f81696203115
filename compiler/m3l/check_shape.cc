// Convex parts of a hull that are not lists of points: boxes, cylinders, spheres and meshes.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "compiler/m3l/check_module.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/m3l/read_mesh.h"

namespace morphbus::m3l::internal {
namespace {

using Eigen::Vector3d;

constexpr int kDefaultSides = 24;
constexpr int kMaxSides = 100;
// Each edge of an octahedron is cut into so many, which gives a sphere 4 n² + 2 corners.
constexpr int kSphereSteps = 4;
// A hull of more corners takes too long to compare with others.
constexpr size_t kMaxMeshCorners = 500;

/// The arguments of one shape, `key=value` each.
class ShapeReader {
 public:
  /// Reports arguments that the shape does not have, has twice, or that have no key.
  ShapeReader(const Expr& call, const std::vector<std::string>& known, ModuleScope& scope)
      : call_(call), scope_(scope) {
    std::set<std::string> seen;
    for (const Expr& child : call.children) {
      const std::string key = child.kind == ExprKind::kAssign ? PathText(child.path) : "";
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        Error(child.span, fmt::format("'{}' has no argument {}", Shape(),
                                      key.empty() ? "without a name" : "'" + key + "'"))
            .hint = NameHint(key, known, "its arguments are");
      } else if (!seen.insert(key).second) {
        Error(child.span, "'" + key + "' is given twice");
      }
    }
  }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] const std::string& Shape() const { return call_.path[0].text; }

  /// The value of an argument; null if it is not there.
  [[nodiscard]] const Expr* Find(const std::string& key) const {
    for (const Expr& child : call_.children) {
      if (child.kind == ExprKind::kAssign && PathText(child.path) == key) return &child.children[0];
    }
    return nullptr;
  }

  /// A length above 0, in metres; 1 after an error.
  double Length(const std::string& key) {
    const Expr* expr = Required(key, key + "=0.5");
    const std::optional<double> value =
        expr ? EvaluateNumber(*expr, &scope_.diagnostics) : std::nullopt;
    if (!value) return Failed();
    return Positive(*value, *expr, key);
  }

  /// The size of a box in metres.
  Vector3d Size() {
    const Expr* expr = Required("size", "size=(1, 1, 1)");
    const std::optional<Vector3d> value =
        expr ? EvaluateVector(*expr, "size", &scope_.diagnostics) : std::nullopt;
    if (!value) return Vector3d::Constant(Failed());
    return {Positive(value->x(), *expr, "size"), Positive(value->y(), *expr, "size"),
            Positive(value->z(), *expr, "size")};
  }

  /// Where the middle of the shape is, in M (m); `otherwise` if `at` is not given.
  Vector3d At(const Vector3d& otherwise) {
    const Expr* expr = Find("at");
    if (!expr) return otherwise;
    const std::optional<Vector3d> p = EvaluatePoint(*expr, "at", scope_);
    if (!p) Failed();
    return p.value_or(otherwise);
  }

  /// The axis of a cylinder, which is one of the module's.
  AxisSymbol Axis() {
    const Expr* expr = Required("axis", "axis=NAME");
    if (!expr) return {};
    const std::string name = SingleName(*expr);
    const auto found = scope_.module.axes.find(name);
    if (found != scope_.module.axes.end()) {
      // An axis with an error was reported where it stands.
      ok_ = ok_ && found->second.valid;
      return found->second;
    }
    Failed();
    // The axis may be one whose name did not parse, which has been reported.
    if (scope_.names_lost) return {};
    Error(expr->span,
          name.empty() ? "'axis' is the name of an axis" : "there is no axis '" + name + "'")
        .hint = NameHint(name, NamesOf(scope_.module.axes), "axes are");
    return {};
  }

  /// How many sides a cylinder has.
  int Sides() {
    const Expr* expr = Find("sides");
    if (!expr) return kDefaultSides;
    const std::optional<double> value = EvaluateNumber(*expr, &scope_.diagnostics);
    if (!value) Failed();
    if (!value) return kDefaultSides;
    if (*value >= 3 && *value <= kMaxSides && *value == std::floor(*value)) {
      return static_cast<int>(*value);
    }
    Error(expr->span, fmt::format("'sides' is a whole number from 3 to {}", kMaxSides));
    return kDefaultSides;
  }

  source::Diagnostic& Error(const source::Span& span, std::string message) {
    ok_ = false;
    return scope_.diagnostics.Error(span, std::move(message));
  }

 private:
  /// Notes that the shape has an error; what stands in for a length until then.
  double Failed() {
    ok_ = false;
    return 1.0;
  }

  const Expr* Required(const std::string& key, const std::string& example) {
    const Expr* expr = Find(key);
    // What is missing is told once: with another error the argument may be the one that was
    // mistyped.
    if (!expr && ok_) {
      Error(call_.span, "'" + Shape() + "' needs '" + key + "'").hint = "write " + example;
    }
    if (!expr) Failed();
    return expr;
  }

  /// Model units in metres.
  double Positive(double value, const Expr& expr, const std::string& key) {
    const double metres = value * scope_.unit_m;
    // Put this way round the comparison refuses what is not a number.
    if (metres >= 1e-9 && metres <= kMaxCoordinate_m) return metres;
    Error(expr.span, "'" + key + "' is above 0, from 1e-9 to 1e6 metres");
    return 1.0;
  }

  const Expr& call_;
  ModuleScope& scope_;
  bool ok_ = true;
};

std::vector<Vector3d> Box(ShapeReader& reader) {
  const Vector3d half = 0.5 * reader.Size();
  const Vector3d middle = reader.At(Vector3d::Zero());
  std::vector<Vector3d> corners;
  // A bit of the number for each axis: on which side of the middle the corner lies.
  for (int i = 0; i < 8; ++i) {
    const Vector3d side((i & 4) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0,
                        (i & 1) != 0 ? 1.0 : -1.0);
    corners.push_back(middle + side.cwiseProduct(half));
  }
  return corners;
}

/// A prism whose corners lie on the cylinder. The first is on that coordinate axis, or its shadow,
/// which is least like the cylinder's own axis; so 4 k sides look alike from four directions.
std::vector<Vector3d> Cylinder(ShapeReader& reader) {
  const double radius = reader.Length("radius");
  const double length = reader.Length("length");
  const AxisSymbol axis = reader.Axis();
  const Vector3d middle = reader.At(axis.p_MoAo_M);
  const int sides = reader.Sides();
  // The coordinate axis on which w has the smallest part; of equal ones the first, within rounding.
  int least = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(axis.direction[k]) < std::abs(axis.direction[least]) - 1e-9) least = k;
  }
  const Vector3d& w = axis.direction;
  // u is that axis without its part along w, and u, v, w are a right-handed frame.
  const Vector3d u = (Vector3d::Unit(least) - w[least] * w).normalized();
  const Vector3d v = w.cross(u);
  std::vector<Vector3d> corners;
  for (const double end : {-0.5, 0.5}) {
    for (int i = 0; i < sides; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / sides;
      corners.push_back(middle + end * length * w +
                        radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }
  return corners;
}

/// Corners on the sphere: those of an octahedron whose faces are cut into triangles. It looks the
/// same after every quarter turn, as the modules of a lattice do.
std::vector<Vector3d> Sphere(ShapeReader& reader) {
  const double radius = reader.Length("radius");
  const Vector3d middle = reader.At(Vector3d::Zero());
  std::vector<Vector3d> corners;
  // Whole numbers with |x| + |y| + |z| = n are the corners of an octahedron that is cut into n²
  // triangles a face; each is then moved out to the sphere.
  for (int x = -kSphereSteps; x <= kSphereSteps; ++x) {
    for (int y = -kSphereSteps; y <= kSphereSteps; ++y) {
      const int z = kSphereSteps - std::abs(x) - std::abs(y);
      if (z < 0) continue;
      corners.push_back(middle + radius * Vector3d(x, y, z).normalized());
      if (z > 0) corners.push_back(middle + radius * Vector3d(x, y, -z).normalized());
    }
  }
  return corners;
}

/// The convex hull of a file's triangles, whose path is relative to the file that names it.
std::optional<std::vector<Vector3d>> Mesh(const Expr& call, ModuleScope& scope) {
  const auto fail = [&](const source::Span& span, std::string message) -> source::Diagnostic& {
    return scope.diagnostics.Error(span, std::move(message));
  };
  const std::optional<std::string> path = MeshPath(call, scope);
  if (!path) return std::nullopt;
  const Expr& name = call.children[0];
  Result<std::vector<Vector3d>> hull = ReadMeshHull(*path);
  if (!hull) {
    return fail(name.span, hull.error().message)
        .Hint("meshes are STL files, text or binary, beside the file that names them");
  }
  // Only the hull's corners count, however fine the mesh is.
  if (hull->size() > kMaxMeshCorners) {
    return fail(name.span, fmt::format("the convex hull of the mesh has {} corners, the most is {}",
                                       hull->size(), kMaxMeshCorners))
        .Hint("use a simpler mesh, or several convex parts");
  }
  for (Vector3d& p : *hull) {
    p *= scope.unit_m;
    if (!(p.cwiseAbs().maxCoeff() <= kMaxCoordinate_m)) {
      return fail(name.span, "the mesh reaches more than 1e6 metres away")
          .Hint("its coordinates are in model units, here of " + NumberText(scope.unit_m) + " m");
    }
  }
  return *hull;
}

}  // namespace

std::optional<std::string> MeshPath(const Expr& call, ModuleScope& scope) {
  if (call.children.size() != 1 || call.children[0].kind != ExprKind::kString) {
    return scope.diagnostics.Error(call.span, "'mesh' takes the name of a file")
        .Hint("write mesh(\"part.stl\")");
  }
  const Expr& name = call.children[0];
  if (name.text.empty() || name.text.find('\0') != std::string::npos) {
    return scope.diagnostics.Error(name.span, "this is no file name");
  }
  const std::filesystem::path beside =
      std::filesystem::path(scope.sources.name(name.span.file)).parent_path();
  return (beside / name.text).string();
}

bool IsShape(const std::string& function) {
  return function == "box" || function == "cylinder" || function == "sphere" || function == "mesh";
}

std::optional<std::vector<Vector3d>> CheckShape(const Expr& call, ModuleScope& scope) {
  const std::string& shape = call.path[0].text;
  if (shape == "mesh") return Mesh(call, scope);
  const std::vector<std::string> known =
      shape == "box"        ? std::vector<std::string>{"size", "at"}
      : shape == "cylinder" ? std::vector<std::string>{"radius", "length", "axis", "at", "sides"}
                            : std::vector<std::string>{"radius", "at"};
  // Each function reads all its arguments, whatever is wrong with the first, so that all errors are
  // told.
  ShapeReader reader(call, known, scope);
  std::vector<Vector3d> corners = shape == "box"        ? Box(reader)
                                  : shape == "cylinder" ? Cylinder(reader)
                                                        : Sphere(reader);
  if (!reader.ok()) return std::nullopt;
  return corners;
}

}  // namespace morphbus::m3l::internal
