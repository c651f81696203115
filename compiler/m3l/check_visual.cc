// How links look: meshes as they are, and colours.

#include <fmt/format.h>

#include <algorithm>

#include "compiler/m3l/check_module.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/m3l/read_mesh.h"
#include "compiler/model/visual_limits.h"

namespace morphbus::m3l::internal {

std::optional<model::VisualPart> CheckVisualMesh(const Expr& call, ModuleScope& scope) {
  const std::optional<std::string> path = MeshPath(call, scope);
  if (!path) return std::nullopt;
  const Expr& name = call.children[0];
  Result<MeshTriangles> mesh = ReadMesh(*path);
  if (!mesh) {
    return scope.diagnostics.Error(name.span, mesh.error().message)
        .Hint(
            "meshes are STL, OBJ and glTF files beside the file that names them, each in one "
            "piece");
  }
  if (mesh->triangles.empty()) {
    return scope.diagnostics.Error(name.span, "all triangles of the mesh are without an area");
  }
  model::VisualPart part{std::move(mesh->points), std::move(mesh->triangles)};
  for (Eigen::Vector3d& p : part.points) {
    p *= scope.unit_m;
    if (!(p.cwiseAbs().maxCoeff() <= model::kMaxVisualReach_m)) {
      return scope.diagnostics.Error(name.span, "the mesh reaches more than 1e6 metres away")
          .Hint("its coordinates are in model units, here of " + NumberText(scope.unit_m) + " m");
    }
  }
  return part;
}

std::optional<Expr> TakeColour(Expr* call, ModuleScope& scope) {
  std::optional<Expr> colour;
  if (call->kind != ExprKind::kCall) return colour;
  std::vector<Expr> others;
  for (Expr& child : call->children) {
    const std::string key = child.kind == ExprKind::kAssign ? PathText(child.path) : "";
    if (key == "color") {
      scope.diagnostics.Error(child.span, "'" + call->path[0].text + "' has no argument 'color'")
          .hint = "did you mean 'colour'?";
    } else if (key != "colour") {
      others.push_back(std::move(child));
    } else if (colour) {
      scope.diagnostics.Error(child.span, "'colour' is given twice");
    } else {
      colour = std::move(child.children[0]);
    }
  }
  call->children = std::move(others);
  return colour;
}

std::optional<Color> CheckColour(const Expr& expr, ModuleScope& scope) {
  const std::string& text = expr.text;
  const bool good =
      expr.kind == ExprKind::kString && text.size() == 7 && text[0] == '#' &&
      std::all_of(text.begin() + 1, text.end(), [](unsigned char c) {
        return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
      });
  if (!good) {
    return scope.diagnostics.Error(expr.span, "a colour is red, green and blue in hexadecimal")
        .Hint("write \"#4d78a8\"");
  }
  Color color;
  for (size_t i = 0; i < 3; ++i)
    color[i] = std::stoi(text.substr(1 + 2 * i, 2), nullptr, 16) / 255.0;
  return color;
}

}  // namespace morphbus::m3l::internal
