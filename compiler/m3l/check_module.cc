#include "compiler/m3l/check_module.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "compiler/m3l/docking_turn.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/model/link_mass.h"

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
  // A member whose name did not parse may be the one that others refer to.
  const auto add = [&](const Declaration& decl, const char* kind) {
    scope.names_lost = scope.names_lost || decl.name.text.empty();
    if (decl.name.text.empty()) return;
    const auto [it, fresh] = seen.emplace(decl.name.text, decl.name.span);
    if (fresh) return;
    scope.diagnostics
        .Error(decl.name.span, fmt::format("{} '{}': the name is taken", kind, decl.name.text))
        .Note(it->second, "first used here");
  };
  for (const PointDecl& point : scope.module.decl->points) add(point, "point");
  for (const LinkDecl& link : scope.module.decl->links) add(link, "link");
  for (const AxisDecl& axis : scope.module.decl->axes) add(axis, "axis");
  for (const JointDecl& joint : scope.module.decl->joints) add(joint, "joint");
  for (const SensorDecl& sensor : scope.module.decl->sensors) add(sensor, "sensor");
}

/// What joints do once the module is dead.
void CheckOnLoss(AttributeReader& attributes, ModuleScope& scope) {
  const Expr* on_loss = attributes.Optional("on_loss");
  if (!on_loss) return;
  // Limp is what a module type has without the attribute.
  const std::string text = on_loss->kind == ExprKind::kString ? on_loss->text : "";
  if (text == "hold") scope.module.type.on_loss = model::OnLoss::kHold;
  if (text == "hold" || text == "limp") return;
  scope.diagnostics.Error(on_loss->span, "'on_loss' is \"limp\" or \"hold\"");
}

/// The module's own attributes. The length of a model unit comes first, since everything else is
/// scaled by it.
void CheckAttributes(ModuleScope& scope) {
  const ModuleDecl& decl = *scope.module.decl;
  AttributeReader attributes(decl, "module '" + decl.name.text + "'", {"unit", "on_loss"},
                             &scope.diagnostics);
  CheckOnLoss(attributes, scope);
  const Expr* unit = attributes.Optional("unit");
  const std::optional<double> value =
      unit ? EvaluateNumber(*unit, &scope.diagnostics) : std::nullopt;
  // Without a unit, lengths are in metres.
  if (!value) return;
  if (*value < 1e-9 || *value > kMaxCoordinate_m) {
    scope.diagnostics.Error(unit->span, "'unit' is metres per model unit, from 1e-9 to 1e6");
    return;
  }
  scope.unit_m = scope.module.type.unit_m = *value;
}

/// All points of the module and of its links; names are unique within each.
void CheckPoints(ModuleScope& scope) {
  for (const PointDecl& decl : scope.module.decl->points) {
    scope.module.points.emplace(decl.name.text, CheckPoint(decl, scope));
  }
  for (const LinkDecl& link : scope.module.decl->links) {
    std::map<std::string, PointSymbol>& own = scope.module.link_points.emplace_back();
    for (const PointDecl& decl : link.points) {
      const auto [it, fresh] = own.emplace(decl.name.text, CheckPoint(decl, scope));
      // Points without a name were reported by the parser.
      if (fresh || decl.name.text.empty()) continue;
      scope.diagnostics
          .Error(decl.name.span,
                 fmt::format("link '{}' has two points '{}'", link.name.text, decl.name.text))
          .Note(it->second.decl->name.span, "first used here");
    }
  }
}

/// Connectors in the order of their declarations, which the numbering of connections depends on.
void CollectConnectors(ModuleScope& scope) {
  CheckedModule& module = scope.module;
  // Points of the module are connectors of the link that groups them, points of a link are its own.
  // A connector in no link is an error, unless a link's grouping did not parse.
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
  // The tables are sorted by name; the order of the source is restored.
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.first->decl->name.span.begin < b.first->decl->name.span.begin;
  });
  // Links may have points of one name, but connectors are named across the module.
  for (const auto& [point, link] : found) {
    const Name& name = point->decl->name;
    const auto [it, fresh] = module.connector_spans.emplace(name.text, name.span);
    if (!fresh) {
      scope.diagnostics.Error(name.span, "there is another connector '" + name.text + "'")
          .Note(it->second, "first used here");
    } else if (point->p_M) {
      module.type.connectors.push_back(MakeConnector(*point, link, scope));
    }
  }
}

/// The directions of all connectors and of their sub-points, written or not.
void FindDirections(CheckedModule& module) {
  std::set<std::string> written;
  for (const model::Connector& connector : module.type.connectors) {
    for (const auto& [point, normal] : connector.normals) written.insert(point);
  }
  for (int i = 0; i < std::ssize(module.type.connectors); ++i) {
    const model::Connector& connector = module.type.connectors[i];
    std::map<std::string, Eigen::Vector3d>& directions = module.directions.emplace_back();
    directions = connector.normals;
    if (const auto normal = NormalOf(module, i, {});
        normal && normal->outward && !written.count("")) {
      directions[""] = normal->direction;
    }
    for (size_t k = 0; k < connector.subpoints.size(); ++k) {
      const Eigen::Vector3d way = connector.subpoints[k] - connector.p_MoCo_M;
      const std::string& name = connector.subpoint_names[k];
      if (way.norm() > 1e-6 * module.extent_m && !written.count(name)) {
        directions[name] = way.normalized();
      }
    }
  }
}

/// Leaves out of the model the normals of connectors that say what the geometry says by itself:
/// whoever writes them down changes neither the model's hash nor what carries it.
void LeaveOutImpliedNormals(CheckedModule& module) {
  // As far apart as rounding leaves two ways to the same direction.
  constexpr double kSame = 1e-9;
  std::map<int, Eigen::Vector3d> middles;
  for (int i = 0; i < std::ssize(module.type.connectors); ++i) {
    model::Connector& connector = module.type.connectors[i];
    const auto written = connector.normals.find("");
    if (written == connector.normals.end()) continue;
    const Eigen::Vector3d direction = written->second;
    connector.normals.erase(written);
    const std::optional<model::FaceNormal> implied = NormalOf(module, i, {});
    bool same = implied && implied->outward && (implied->direction - direction).norm() < kSame;
    if (same) {
      // Exports find the way out from the centre of mass, which must not lead elsewhere.
      const auto [middle, fresh] = middles.try_emplace(connector.link);
      if (fresh) {
        middle->second = model::ComputeLinkMass(module.type, connector.link).p_LoLcm_L;
      }
      same = direction.dot(connector.p_MoCo_M - middle->second) > kSame * module.extent_m;
    }
    if (!same) connector.normals[""] = direction;
  }
}

/// False, after an error, if the module is too large to look at more closely.
bool CheckSizes(const ModuleScope& scope) {
  const ModuleDecl& decl = *scope.module.decl;
  // Everything is counted from the syntax tree, before any table is built.
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
  // All four are checked, so that each excess is told.
  const bool checks[] = {check(members, kMaxMembers, "members"),
                         check(decl.links.size(), kMaxLinks, "links"),
                         check(connectors, kMaxConnectors, "connectors"),
                         check(subpoints, kMaxSubpoints, "sub-points on one point")};
  return std::all_of(std::begin(checks), std::end(checks), [](bool holds) { return holds; });
}

}  // namespace
}  // namespace internal

CheckedModule CheckModule(const ModuleDecl& decl, const source::SourceSet& sources,
                          source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  CheckedModule module;
  module.decl = &decl;
  module.type.name = decl.name.text;
  // The parts below share what is known of the module so far.
  internal::ModuleScope scope{module, sources, *diagnostics, 1.0, false, {}};
  if (!internal::CheckSizes(scope)) return module;
  // The order matters: each step needs the names that the steps before it have found.
  internal::CheckNames(scope);
  internal::CheckAttributes(scope);
  internal::CheckPoints(scope);
  internal::CheckAxes(scope);
  internal::CheckLinks(scope);
  internal::CollectConnectors(scope);
  internal::FindDirections(module);
  internal::CheckJoints(scope);
  internal::CheckSensors(scope);
  // Errors of the parser count too: what did not parse is missing from the module.
  const auto broken = [](const auto& list) {
    return std::any_of(list.begin(), list.end(), [](const Declaration& d) { return d.broken; });
  };
  module.valid = diagnostics->error_count() == errors && !decl.broken && !broken(decl.points) &&
                 !broken(decl.links) && !broken(decl.axes) && !broken(decl.joints) &&
                 !broken(decl.sensors);
  if (module.valid) internal::LeaveOutImpliedNormals(module);
  return module;
}

}  // namespace morphbus::m3l
