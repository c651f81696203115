#include "compiler/m3l/check_module.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l {
namespace internal {
namespace {

// Bounds that keep every later stage quick on hostile input; real modules have a handful of each.
constexpr size_t kMaxConnectors = 200;
constexpr size_t kMaxSubpoints = 64;
constexpr size_t kMaxMembers = 5000;
constexpr size_t kMaxLinks = 100;

/// Reports names that members of a module share; they have one name space.
void CheckNames(ModuleScope& scope) {
  std::map<std::string, source::Span> seen;
  const auto add = [&](const Declaration& decl, const char* kind) {
    scope.names_lost = scope.names_lost || decl.name.text.empty();
    if (decl.name.text.empty()) return;
    const auto [it, fresh] = seen.emplace(decl.name.text, decl.name.span);
    if (fresh) return;
    source::Diagnostic& d = scope.diagnostics.Error(
        decl.name.span, fmt::format("{} '{}': the name is taken", kind, decl.name.text));
    d.notes.push_back({it->second, "first used here"});
  };
  for (const PointDecl& point : scope.module.decl->points) add(point, "point");
  for (const LinkDecl& link : scope.module.decl->links) add(link, "link");
  for (const AxisDecl& axis : scope.module.decl->axes) add(axis, "axis");
  for (const JointDecl& joint : scope.module.decl->joints) add(joint, "joint");
}

void CheckUnit(ModuleScope& scope) {
  const ModuleDecl& decl = *scope.module.decl;
  AttributeReader attributes(decl, "module '" + decl.name.text + "'", {"unit"}, scope.diagnostics);
  const Expr* unit = attributes.Optional("unit");
  const std::optional<double> value =
      unit ? EvaluateNumber(*unit, scope.diagnostics) : std::nullopt;
  if (!value) return;
  if (*value < 1e-9 || *value > kMaxCoordinate_m) {
    scope.diagnostics.Error(unit->span, "'unit' is metres per model unit, from 1e-9 to 1e6");
    return;
  }
  scope.unit_m = scope.module.type.unit_m = *value;
}

void CheckPoints(ModuleScope& scope) {
  for (const PointDecl& decl : scope.module.decl->points) {
    scope.module.points.emplace(decl.name.text, CheckPoint(decl, scope));
  }
  for (const LinkDecl& link : scope.module.decl->links) {
    std::map<std::string, PointSymbol>& own = scope.module.link_points.emplace_back();
    for (const PointDecl& decl : link.points) {
      const auto [it, fresh] = own.emplace(decl.name.text, CheckPoint(decl, scope));
      if (fresh || decl.name.text.empty()) continue;
      source::Diagnostic& d = scope.diagnostics.Error(
          decl.name.span,
          fmt::format("link '{}' has two points '{}'", link.name.text, decl.name.text));
      d.notes.push_back({it->second.decl->name.span, "first used here"});
    }
  }
}

double Extent(const CheckedModule& module) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  const auto add = [&](const std::map<std::string, PointSymbol>& points) {
    for (const auto& [name, point] : points) {
      if (point.p_M) low = low.cwiseMin(*point.p_M), high = high.cwiseMax(*point.p_M);
      for (const Eigen::Vector3d& p : point.subpoints)
        low = low.cwiseMin(p), high = high.cwiseMax(p);
    }
  };
  add(module.points);
  for (const auto& own : module.link_points) add(own);
  return low.x() <= high.x() ? (high - low).maxCoeff() : 0.0;
}

/// Connectors in the order of their declarations, which the numbering of connections depends on.
void CollectConnectors(ModuleScope& scope) {
  CheckedModule& module = scope.module;
  std::vector<std::pair<const PointSymbol*, int>> found;
  for (const auto& [name, point] : module.points) {
    if (!point.connector) continue;
    const auto it = scope.link_of.find(name);
    if (it != scope.link_of.end()) {
      found.emplace_back(&point, it->second.first);
    } else if (!scope.names_lost &&
               std::none_of(module.decl->links.begin(), module.decl->links.end(),
                            [](const LinkDecl& l) { return l.broken; })) {
      scope.diagnostics.Error(point.decl->name.span, "connector '" + name + "' belongs to no link")
          .hint = "name it in the grouping of the link that carries it";
    }
  }
  for (size_t link = 0; link < module.link_points.size(); ++link) {
    for (const auto& [name, point] : module.link_points[link]) {
      if (point.connector) found.emplace_back(&point, static_cast<int>(link));
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.first->decl->name.span.begin < b.first->decl->name.span.begin;
  });
  for (const auto& [point, link] : found) {
    const Name& name = point->decl->name;
    const auto [it, fresh] = module.connector_spans.emplace(name.text, name.span);
    if (!fresh) {
      scope.diagnostics.Error(name.span, "there is another connector '" + name.text + "'")
          .notes.push_back({it->second, "first used here"});
    } else if (point->p_M) {
      module.type.connectors.push_back(MakeConnector(*point, link, scope));
    }
  }
}

/// False, after an error, if the module is too large to look at more closely.
bool CheckSizes(const ModuleScope& scope) {
  const ModuleDecl& decl = *scope.module.decl;
  size_t members = decl.points.size() + decl.links.size() + decl.axes.size() + decl.joints.size();
  size_t connectors = 0, subpoints = 0;
  const auto count = [&](const std::vector<PointDecl>& points) {
    for (const PointDecl& point : points) {
      connectors += point.Find("connector") != nullptr ? 1 : 0;
      subpoints = std::max(subpoints, point.subpoints.size());
    }
  };
  count(decl.points);
  for (const LinkDecl& link : decl.links) {
    members += link.points.size();
    count(link.points);
  }
  const auto check = [&](size_t number, size_t most, const char* what) {
    if (number <= most) return true;
    scope.diagnostics.Error(decl.name.span, fmt::format("module '{}' has {} {}, the most is {}",
                                                        decl.name.text, number, what, most));
    return false;
  };
  return check(members, kMaxMembers, "members") & check(decl.links.size(), kMaxLinks, "links") &
         check(connectors, kMaxConnectors, "connectors") &
         check(subpoints, kMaxSubpoints, "sub-points on one point");
}

}  // namespace
}  // namespace internal

CheckedModule CheckModule(const ModuleDecl& decl, source::Diagnostics& diagnostics) {
  const int errors = diagnostics.error_count();
  CheckedModule module;
  module.decl = &decl;
  module.type.name = decl.name.text;
  internal::ModuleScope scope{module, diagnostics, 1.0, false, {}};
  if (!internal::CheckSizes(scope)) return module;
  internal::CheckNames(scope);
  internal::CheckUnit(scope);
  internal::CheckPoints(scope);
  module.extent_m = internal::Extent(module);
  internal::CheckLinks(scope);
  internal::CollectConnectors(scope);
  internal::CheckAxesAndJoints(scope);
  const auto broken = [](const auto& list) {
    return std::any_of(list.begin(), list.end(), [](const Declaration& d) { return d.broken; });
  };
  module.valid = diagnostics.error_count() == errors && !decl.broken && !broken(decl.points) &&
                 !broken(decl.links) && !broken(decl.axes) && !broken(decl.joints);
  return module;
}

}  // namespace morphbus::m3l
