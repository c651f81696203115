#include <fmt/format.h>

#include <algorithm>

#include "compiler/m3l/check_module.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

/// The unit vector of a `normal=`, if there is one.
std::optional<Eigen::Vector3d> CheckNormal(AttributeReader& attributes, const ModuleScope& scope) {
  const Expr* expr = attributes.Optional("normal");
  const std::optional<Eigen::Vector3d> normal =
      expr ? EvaluateVector(*expr, "normal", &scope.diagnostics) : std::nullopt;
  if (!normal) return std::nullopt;
  // A direction so short is taken for zero: it says nothing after rounding.
  if (normal->norm() < 1e-12) {
    return scope.diagnostics.Error(expr->span, attributes.what() + " has a normal of length zero");
  }
  return normal->stableNormalized();
}

/// Adds a sub-point of `owner` to `symbol`, unless its coordinates have errors.
void CheckSubpoint(const PointDecl& decl, const std::string& owner, const ModuleScope& scope,
                   PointSymbol& symbol) {
  const std::string what = fmt::format("sub-point '{}.{}'", owner, decl.name.text);
  AttributeReader attributes(decl, what, {"coords", "normal"}, &scope.diagnostics);
  const Expr* coords = attributes.Required("coords", "write coords=(x, y, z)");
  const std::optional<Eigen::Vector3d> p_M =
      coords ? EvaluatePoint(*coords, "coords", scope) : std::nullopt;
  const std::optional<Eigen::Vector3d> normal = CheckNormal(attributes, scope);
  // A sub-point without a position is left out, with its normal.
  if (!p_M) return;
  symbol.subpoint_names.push_back(decl.name.text);
  symbol.subpoints.push_back(*p_M);
  if (normal) symbol.normals[decl.name.text] = *normal;
}

/// Sub-points of a connector that lie on each other could not be told apart.
void CheckDistinct(const PointSymbol& symbol, const ModuleScope& scope) {
  std::map<std::string, const PointDecl*> seen;
  for (const PointDecl& decl : symbol.decl->subpoints) {
    // The parser has reported a name that is missing.
    if (decl.name.text.empty()) continue;
    const auto [it, fresh] = seen.emplace(decl.name.text, &decl);
    if (fresh) continue;
    scope.diagnostics
        .Error(decl.name.span,
               fmt::format("'{}' has two sub-points '{}'", symbol.decl->name.text, decl.name.text))
        .Note(it->second->name.span, "first used here");
  }
}

/// Keys of a point that is no connector: only connectors have attributes and states.
void CheckKeysOfPoint(const PointDecl& decl, const ModuleScope& scope) {
  // With the flag misspelt, the other keys are in their place.
  const bool flag_misspelt =
      std::any_of(decl.attributes.begin(), decl.attributes.end(), [](const Attribute& attribute) {
        return !source::NearestName(attribute.key.text, {"connector"}).empty();
      });
  for (const Attribute& attribute : decl.attributes) {
    const std::string& key = attribute.key.text;
    if (key == "coords" || key == "normal" || key == "connector" || attribute.broken) continue;
    // A state on a point that is no connector is an error, as a program may rely on it; other
    // attributes are merely useless.
    if (attribute.value && attribute.value->kind == ExprKind::kList) {
      scope.diagnostics
          .Error(attribute.key.span, fmt::format("point '{}' is no connector and has no state '{}'",
                                                 decl.name.text, key))
          .hint = "flag it: connector";
      continue;
    }
    const std::string hint =
        source::NearestHint(key, {"coords", "normal", "connector"}, "flag it: connector");
    if (flag_misspelt && hint == "flag it: connector") continue;
    scope.diagnostics
        .Warning(attribute.key.span,
                 fmt::format("point '{}' is no connector, so its '{}' means nothing",
                             decl.name.text, key))
        .hint = hint;
  }
}

}  // namespace

std::optional<Eigen::Vector3d> EvaluatePoint(const Expr& expr, const std::string& what,
                                             const ModuleScope& scope) {
  // The vector is in model units, as all lengths of the source are.
  const std::optional<Eigen::Vector3d> p = EvaluateVector(expr, what, &scope.diagnostics);
  if (!p) return std::nullopt;
  // Squares of greater lengths would lose the micrometres.
  const Eigen::Vector3d metres = *p * scope.unit_m;
  if (!(metres.cwiseAbs().maxCoeff() <= kMaxCoordinate_m)) {
    return scope.diagnostics.Error(expr.span, "'" + what + "' lies more than 1e6 metres away")
        .Hint("a model unit is " + NumberText(scope.unit_m) +
              " m here, which 'unit=' of the module sets");
  }
  return metres;
}

PointSymbol CheckPoint(const PointDecl& decl, const ModuleScope& scope) {
  PointSymbol symbol;
  symbol.decl = &decl;
  // Further keys are the attributes of a connector, freely named.
  AttributeReader attributes(decl, "point '" + decl.name.text + "'", {}, &scope.diagnostics);
  symbol.connector = attributes.Flag("connector");
  for (const PointDecl& sub : decl.subpoints) CheckSubpoint(sub, decl.name.text, scope, symbol);
  CheckDistinct(symbol, scope);
  // A point may be no more than the name of its sub-points, but a connector needs a centre.
  const bool needed = symbol.connector || decl.subpoints.empty();
  const Expr* coords = needed ? attributes.Required("coords", "write coords=(x, y, z)")
                              : attributes.Optional("coords");
  if (coords) symbol.p_M = EvaluatePoint(*coords, "coords", scope);
  const std::optional<Eigen::Vector3d> normal = CheckNormal(attributes, scope);
  if (normal) symbol.normals[""] = *normal;
  if (!symbol.connector) CheckKeysOfPoint(decl, scope);
  return symbol;
}

model::Connector MakeConnector(const PointSymbol& symbol, int link, const ModuleScope& scope) {
  model::Connector connector;
  // The geometry is worked out already; what is left are the freely named attributes.
  connector.name = symbol.decl->name.text;
  connector.link = link;
  connector.p_MoCo_M = symbol.p_M.value_or(Eigen::Vector3d::Zero());
  connector.subpoint_names = symbol.subpoint_names;
  connector.subpoints = symbol.subpoints;
  connector.normals = symbol.normals;
  for (const Attribute& attribute : symbol.decl->attributes) {
    const std::string& key = attribute.key.text;
    if (key == "coords" || key == "connector" || key == "normal" || attribute.broken) continue;
    if (!attribute.value) {
      connector.attributes.emplace(key, true);  // A bare flag.
    } else if (attribute.value->kind == ExprKind::kList) {
      // A list is a state variable with these values.
      auto values = EvaluateStates(*attribute.value, &scope.diagnostics);
      if (values) connector.states.push_back({key, std::move(*values)});
    } else if (attribute.value->kind == ExprKind::kTuple && attribute.value->children.size() == 3) {
      // A vector under another key is a slip for one of the two keys that take vectors.
      scope.diagnostics
          .Error(attribute.value->span,
                 fmt::format("attribute '{}' of a connector is one value, not three", key))
          .hint = source::NearestHint(key, {"coords", "normal"},
                                      "vectors are coords=(x, y, z) and normal=(x, y, z)");
    } else {
      const auto value = EvaluateAttribute(*attribute.value, &scope.diagnostics);
      if (value) connector.attributes.emplace(key, *value);
    }
  }
  return connector;
}

}  // namespace morphbus::m3l::internal
