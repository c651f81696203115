#include <fmt/format.h>

#include <algorithm>

#include <Eigen/Geometry>

#include "compiler/m3l/check_module.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/link_mass.h"
#include "compiler/model/visual_limits.h"

namespace morphbus::m3l::internal {
namespace {

// Defaults of docs/m3l.md: the density of a link without `mass`, and the thickness that a flat hull
// has for it, relative to the module's extent.
constexpr double kDensity_kg_m3 = 500.0;
// A module that is a single point still needs links of some mass.
constexpr double kLeastMass_kg = 1e-6;
constexpr size_t kMaxHullPoints = 500;
constexpr size_t kMaxParts = 50;

/// The nearest number of single precision. It is not inline: when GCC 12 vectorizes, it takes the
/// conversion of two numbers there and back for nothing, and leaves them as they were.
[[gnu::noinline]] double InSinglePrecision(double value) { return static_cast<float>(value); }

/// Checks one link: the points grouped in it, its hull and its numbers.
class LinkChecker {
 public:
  LinkChecker(ModuleScope& scope, int index)
      : scope_(scope),
        index_(index),
        decl_(scope.module.decl->links[index]),
        own_(scope.module.link_points[index]),
        attributes_(decl_, "link '" + decl_.name.text + "'",
                    {"grouping", "hull", "visual", "colour", "mass", "friction", "mass_spread"},
                    &scope.diagnostics) {}

  /// Everything but the numbers.
  model::Link Check() {
    model::Link link;
    link.name = decl_.name.text;
    if (const Expr* grouping = attributes_.Optional("grouping")) CheckGrouping(*grouping);
    const int errors = scope_.diagnostics.error_count();
    if (const Expr* hull = attributes_.Optional("hull")) CheckHull(*hull, &link);
    hull_ok_ = errors == scope_.diagnostics.error_count();
    CheckVisual(&link);
    return link;
  }

  /// The numbers. They come last, as the default of the mass depends on the module's extent, and
  /// that on the hulls of all links.
  void CheckNumbers(model::Link& link) {
    // It is not worked out from a hull with errors.
    const bool given = decl_.Find("mass") != nullptr;
    for (const auto& attribute : model::NumericAttributes<model::Link>()) {
      CheckNumber(attribute, scope_, &attributes_, &link);
    }
    if (!given && hull_ok_) link.mass_kg = DefaultMass(link);
  }

 private:
  /// Every point of the module that the link names becomes its own.
  void CheckGrouping(const Expr& grouping) {
    // A single name needs no parentheses.
    const std::vector<Expr>& names =
        grouping.kind == ExprKind::kTuple ? grouping.children : std::vector<Expr>{grouping};
    for (const Expr& expr : names) {
      if (scope_.diagnostics.full()) return;
      const std::string name = SingleName(expr);
      if (name.empty()) {
        scope_.diagnostics.Error(expr.span, "'grouping' lists names of points");
      } else if (!own_.count(name) && !scope_.module.points.count(name)) {
        UnknownPoint(name, expr.span);
      } else if (!own_.count(name)) {
        Group(name, expr.span);
      }
    }
  }

  /// Gives point `name` to this link; a point has one link at most.
  void Group(const std::string& name, const source::Span& span) {
    const auto [it, fresh] = scope_.link_of.emplace(name, std::pair(index_, span));
    if (fresh) return;
    const bool same = it->second.first == index_;
    scope_.diagnostics
        .Error(span, same ? "point '" + name + "' is named twice"
                          : fmt::format("point '{}' is in two links, '{}' and '{}'", name,
                                        scope_.module.decl->links[it->second.first].name.text,
                                        decl_.name.text))
        .Note(it->second.second, "first named here");
  }

  /// Reports a name that is no point, unless it may be one that did not parse.
  void UnknownPoint(const std::string& name, const source::Span& span) {
    if (scope_.names_lost || decl_.broken) return;
    std::vector<std::string> names;
    for (const auto& [own, symbol] : own_) names.push_back(own);
    for (const auto& [point, symbol] : scope_.module.points) names.push_back(point);
    scope_.diagnostics.Error(span, "there is no point '" + name + "'").hint =
        NameHint(name, names, "points are");
  }

  /// The convex parts of a hull, `convex(...) + box(...) + ...`, in M (m).
  void CheckHull(const Expr& outer, model::Link* link) {
    const Expr& hull = Unwrapped(outer);
    // Only sums of parts are hulls of parts; a difference is no shape.
    const bool sum =
        hull.kind == ExprKind::kSum && hull.ops.find_first_not_of('+') == std::string::npos;
    if (!sum) {
      link->hull = CheckPart(hull);
      return;
    }
    for (const Expr& child : hull.children) {
      if (scope_.diagnostics.full()) return;
      const std::vector<Eigen::Vector3d> part = CheckPart(child);
      if (part.empty()) continue;
      link->hull.insert(link->hull.end(), part.begin(), part.end());
      // The parts lie one behind the other in one list, each with its end.
      link->part_ends.push_back(static_cast<int>(link->hull.size()));
    }
    if (link->part_ends.size() > kMaxParts || link->hull.size() > kMaxHullPoints) {
      scope_.diagnostics.Error(hull.span, fmt::format("a hull has at most {} parts and {} points",
                                                      kMaxParts, kMaxHullPoints));
    }
    // With parts missing after an error the shape is of no use; one that is left is no list.
    if (link->part_ends.size() < hull.children.size()) {
      link->hull.clear();
      link->part_ends.clear();
    }
  }

  /// How the link looks: the parts of `visual`, or those of its hull in the colour that it has.
  void CheckVisual(model::Link* link) {
    const Expr* visual = attributes_.Optional("visual");
    const Expr* colour = attributes_.Optional("colour");
    const std::optional<Color> own = colour ? CheckColour(*colour, scope_) : std::nullopt;
    if (visual) {
      link->visual = CheckVisualParts(*visual);
    } else if (own) {
      link->visual = link->Looks();
      if (link->hull.empty() && decl_.Find("hull") == nullptr) {
        scope_.diagnostics.Error(colour->span, "there is nothing that has this colour")
            .Hint("give the link a hull, or visual=...");
      }
    }
    size_t size = 0;
    for (model::VisualPart& part : link->visual) {
      if (!part.color) part.color = own;
      // Viewers have single precision, and so have files.
      for (Eigen::Vector3d& p : part.points) {
        for (int k = 0; k < 3; ++k) p[k] = InSinglePrecision(p[k]);
      }
      size += model::SizeOf(part);
    }
    // What is seen travels with every run; more is finer than any picture.
    if (link->visual.size() > model::kMaxVisualParts || size > model::kMaxVisualSize) {
      scope_.diagnostics
          .Error(
              (visual ? visual : colour)->span,
              fmt::format("what is seen of a link has at most {} parts and {} points and "
                          "triangles, and this has {} and {}",
                          model::kMaxVisualParts, model::kMaxVisualSize, link->visual.size(), size))
          .Hint("use a coarser mesh");
      link->visual.clear();
    }
  }

  /// The parts of `visual`; those with errors are missing.
  std::vector<model::VisualPart> CheckVisualParts(const Expr& outer) {
    const Expr& visual = Unwrapped(outer);
    const bool sum =
        visual.kind == ExprKind::kSum && visual.ops.find_first_not_of('+') == std::string::npos;
    std::vector<model::VisualPart> parts;
    for (const Expr& child : sum ? visual.children : std::vector<Expr>{visual}) {
      if (scope_.diagnostics.full()) break;
      // The colour is no part of the shape.
      Expr shape = Unwrapped(child);
      const std::optional<Expr> colour = TakeColour(&shape, scope_);
      std::optional<model::VisualPart> part;
      if (shape.kind == ExprKind::kCall && shape.path[0].text == "mesh") {
        part = CheckVisualMesh(shape, scope_);
      } else if (std::vector<Eigen::Vector3d> points = CheckPart(shape); !points.empty()) {
        part = model::VisualPart{std::move(points)};
      }
      if (!part) continue;
      if (colour) part->color = CheckColour(*colour, scope_);
      parts.push_back(std::move(*part));
    }
    return parts;
  }

  /// The points of one convex part, in M (m); none if there is an error.
  std::vector<Eigen::Vector3d> CheckPart(const Expr& outer) {
    Expr part = Unwrapped(outer);
    if (const std::optional<Expr> colour = TakeColour(&part, scope_)) {
      scope_.diagnostics.Error(colour->span, "a hull has no colour")
          .Hint("colours stand in the parts of visual=, or as colour= of the link");
      return {};
    }
    if (part.kind == ExprKind::kCall && part.path[0].text == "convex") return CheckConvex(part);
    if (part.kind == ExprKind::kCall && IsShape(part.path[0].text)) {
      return CheckShape(part, scope_).value_or(std::vector<Eigen::Vector3d>{});
    }
    scope_.diagnostics
        .Error(part.span,
               "a shape is written as convex(...), box(...), cylinder(...), sphere(...) or "
               "mesh(...)")
        .hint = "list points in it, as in: convex(c1.point, " + decl_.name.text +
                ".point); several parts are joined by '+'";
    return {};
  }

  /// The points of `convex(...)`, in M (m); none if there is an error.
  std::vector<Eigen::Vector3d> CheckConvex(const Expr& hull) {
    std::vector<Eigen::Vector3d> points;
    const int errors = scope_.diagnostics.error_count();
    for (const Expr& child : hull.children) {
      if (scope_.diagnostics.full() || points.size() > kMaxHullPoints) break;
      if (child.kind == ExprKind::kCall && IsShape(child.path[0].text)) {
        // The hull of a shape and whatever else is listed.
        const auto shape = CheckShape(child, scope_).value_or(std::vector<Eigen::Vector3d>{});
        points.insert(points.end(), shape.begin(), shape.end());
      } else if (child.kind != ExprKind::kPath) {
        scope_.diagnostics.Error(child.span,
                                 "a hull lists points, such as c1.point, and shapes such as box");
      } else {
        AddHullPoints(child, points);
      }
    }
    // An empty hull is an error of its own only if nothing else explains it.
    if (points.empty() && !points_missing_ && errors == scope_.diagnostics.error_count()) {
      scope_.diagnostics.Error(hull.span, "the hull has no points");
    }
    if (points.size() > kMaxHullPoints) {
      scope_.diagnostics.Error(hull.span,
                               fmt::format("a hull has at most {} points", kMaxHullPoints));
      points.clear();
    }
    return points;
  }

  /// Resolves `c1`, `c1.point`, `c1._1`, `link.point`, `link.p`, `link.p.point`, `link.p._1`.
  void AddHullPoints(const Expr& expr, std::vector<Eigen::Vector3d>& points) {
    // The first name is a point of this link, or a link of the module, or a point of the module, in
    // this order.
    const std::vector<Name>& path = expr.path;
    const std::map<std::string, PointSymbol>* table = &own_;
    size_t at = 0;
    if (!own_.count(path[0].text)) {
      table = &scope_.module.points;
      for (size_t i = 0; i < scope_.module.decl->links.size(); ++i) {
        if (scope_.module.decl->links[i].name.text != path[0].text) continue;
        table = &scope_.module.link_points[i];
        at = 1;
      }
    }
    // `link.point` stands for all points of a link.
    if (at == 1 && (path.size() == 1 || (path.size() == 2 && path[1].text == "point"))) {
      if (path.size() == 1) {
        scope_.diagnostics.Error(expr.span, "'" + path[0].text + "' is a link").hint =
            "all its points are " + path[0].text + ".point";
        return;
      }
      for (const PointDecl& own : OwnerOf(path[0].text)->points) {
        // Points with errors of their own, and those of a second link of this name, are not there.
        const auto found = table->find(own.name.text);
        if (found != table->end()) {
          AddAll(found->second, points);
        } else {
          points_missing_ = true;
        }
      }
      return;
    }
    const auto it = table->find(path[at].text);
    if (it == table->end()) return UnknownPoint(path[at].text, path[at].span);
    AddFrom(it->second, expr, at, points);
  }

  /// The first declaration of the link called so; there is one.
  const LinkDecl* OwnerOf(const std::string& link) const {
    const std::vector<LinkDecl>& links = scope_.module.decl->links;
    return &*std::find_if(links.begin(), links.end(),
                          [&](const LinkDecl& l) { return l.name.text == link; });
  }

  /// The point itself, if it has coordinates, and all its sub-points.
  static void AddAll(const PointSymbol& symbol, std::vector<Eigen::Vector3d>& points) {
    if (symbol.p_M) points.push_back(*symbol.p_M);
    points.insert(points.end(), symbol.subpoints.begin(), symbol.subpoints.end());
  }

  /// The rest of the path, from the point's name at `path[at]`.
  void AddFrom(const PointSymbol& symbol, const Expr& expr, size_t at,
               std::vector<Eigen::Vector3d>& points) {
    const std::vector<Name>& path = expr.path;
    // The name alone is the point without its sub-points.
    if (path.size() == at + 1) {
      if (symbol.p_M) {
        points.push_back(*symbol.p_M);
      } else if (!symbol.decl->broken && symbol.decl->Find("coords") == nullptr) {
        scope_.diagnostics.Error(expr.span, "'" + path[at].text + "' has no coordinates").hint =
            "its sub-points are " + path[at].text + ".point";
      }
      return;
    }
    // Behind it stands `point`, for all of it, or one sub-point.
    const Name& last = path[at + 1];
    if (path.size() == at + 2 && last.text == "point") return AddAll(symbol, points);
    const std::vector<std::string>& names = symbol.subpoint_names;
    const auto it = std::find(names.begin(), names.end(), last.text);
    if (path.size() == at + 2 && it != names.end()) {
      points.push_back(symbol.subpoints[it - names.begin()]);
    } else if (!symbol.decl->broken) {
      scope_.diagnostics
          .Error(last.span,
                 fmt::format("point '{}' has no sub-point '{}'", path[at].text, last.text))
          .hint = NameHint(last.text, names, "sub-points are");
    }
  }

  /// Volume of the parts times density, flat ones being given some thickness (docs/m3l.md, links).
  double DefaultMass(const model::Link& link) const {
    const double thickness = model::kFlatThickness * scope_.module.extent_m;
    // Without a hull the link is a cube as large as a hull would at least be.
    double volume = link.hull.empty() ? thickness * thickness * thickness : 0.0;
    for (const auto& part : link.Parts()) {
      volume += model::HullVolume(model::ThickenFlat(part, thickness));
    }
    return std::max(kDensity_kg_m3 * volume, kLeastMass_kg);
  }

  ModuleScope& scope_;
  int index_;
  const LinkDecl& decl_;
  const std::map<std::string, PointSymbol>& own_;
  AttributeReader attributes_;
  bool hull_ok_ = false;         ///< The hull, if any, has no error.
  bool points_missing_ = false;  ///< The hull names points that fell to another error.
};

/// The largest side of the box round all points and hulls (m), which tolerances are relative to.
double Extent(const CheckedModule& module) {
  Eigen::AlignedBox3d box;
  // Points that have errors in their coordinates have none, and do not count.
  const auto add = [&](const std::map<std::string, PointSymbol>& points) {
    for (const auto& [name, point] : points) {
      if (point.p_M) box.extend(*point.p_M);
      for (const Eigen::Vector3d& p : point.subpoints) box.extend(p);
    }
  };
  add(module.points);
  for (const auto& own : module.link_points) add(own);
  for (const model::Link& link : module.type.links) {
    for (const Eigen::Vector3d& p : link.hull) box.extend(p);
  }
  return box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
}

}  // namespace

void CheckLinks(ModuleScope& scope) {
  const ModuleDecl& decl = *scope.module.decl;
  if (decl.links.empty() && !decl.broken) {
    scope.diagnostics.Error(decl.name.span, "module '" + decl.name.text + "' has no link").hint =
        "a module has at least one: link NAME: grouping=(...)";
  }
  std::vector<LinkChecker> checkers;
  // The checkers stay for CheckNumbers, which needs the hulls of all links.
  checkers.reserve(decl.links.size());
  for (size_t i = 0; i < decl.links.size(); ++i) {
    checkers.emplace_back(scope, static_cast<int>(i));
    scope.module.type.links.push_back(checkers.back().Check());
  }
  scope.module.extent_m = Extent(scope.module);
  for (size_t i = 0; i < checkers.size(); ++i) checkers[i].CheckNumbers(scope.module.type.links[i]);
}

}  // namespace morphbus::m3l::internal
