#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "compiler/base/disjoint_sets.h"
#include "compiler/m3l/check_module.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

/// Tolerance of the check that paired axes lie on one line: rad, and relative to the extent.
constexpr double kAxisTolerance = 1e-6;

/// Checks one joint: its type, limits, motor and the two axes that it pairs.
class JointChecker {
 public:
  JointChecker(ModuleScope& scope, const JointDecl& decl)
      : scope_(scope),
        decl_(decl),
        attributes_(decl, "joint '" + decl.name.text + "'",
                    {"type", "value", "pair", "torque", "speed", "backlash", "delay"},
                    &scope.diagnostics) {}

  void Check() {
    // Each attribute is checked whatever the others are like, so that all errors are found; only a
    // joint without any is taken over.
    const int errors = scope_.diagnostics.error_count();
    model::Joint joint;
    joint.name = decl_.name.text;
    const bool typed = CheckType(joint);
    if (typed) CheckLimits(joint);
    for (const char* drive : {"torque", "speed"}) {
      CheckNumber(model::AttributeNamed<model::Joint>(drive), scope_, &attributes_, &joint);
    }
    CheckServo(joint, typed);
    const bool paired = CheckPair(joint);
    if (paired && errors == scope_.diagnostics.error_count()) {
      scope_.module.type.joints.push_back(joint);
    }
  }

 private:
  /// The `type`; false if it is missing or unknown.
  bool CheckType(model::Joint& joint) {
    const std::string hint = "types are revolute, continuous, prismatic and fixed";
    const Expr* expr = attributes_.Required("type", hint);
    if (!expr) return false;
    const std::string name = expr->kind == ExprKind::kString ? expr->text : SingleName(*expr);
    const std::optional<model::JointType> type = model::JointTypeNamed(name);
    if (!type) {
      scope_.diagnostics.Error(expr->span, "unknown type of joint").hint =
          NameHint(name, {std::begin(model::kJointTypeNames), std::end(model::kJointTypeNames)},
                   "types are");
      return false;
    }
    joint.type = *type;
    return true;
  }

  /// The `value`: required where a joint has limits, refused where it has none.
  void CheckLimits(model::Joint& joint) {
    const bool limited =
        joint.type == model::JointType::kRevolute || joint.type == model::JointType::kPrismatic;
    if (!limited) {
      // Infinite limits mean that there are none; those of a fixed joint stay 0.
      if (joint.type == model::JointType::kContinuous) {
        joint.lower = -std::numeric_limits<double>::infinity();
        joint.upper = std::numeric_limits<double>::infinity();
      }
      if (const Attribute* value = decl_.Find("value")) {
        const bool fixed = joint.type == model::JointType::kFixed;
        scope_.diagnostics
            .Error(value->key.span,
                   fmt::format("a {} joint has no limits", fixed ? "fixed" : "continuous"))
            .hint = "leave 'value' out, or write type=revolute";
      }
      return;
    }
    const Expr* expr = attributes_.Required("value", "give its limits, as in: value=[-pi/2,pi/2]");
    const std::optional<Interval> limits =
        expr ? EvaluateInterval(*expr, &scope_.diagnostics) : std::nullopt;
    if (!limits) return;
    // Slides are lengths in model units, turns are in radians as they stand.
    const double scale = joint.type == model::JointType::kPrismatic ? scope_.unit_m : 1.0;
    // Both numbers are finite: EvaluateNumber refuses others.
    joint.lower = limits->lower * scale;
    joint.upper = limits->upper * scale;
    if (const std::string why = model::WhyNoLimits(joint.lower, joint.upper); !why.empty()) {
      scope_.diagnostics.Error(expr->span, why);
    } else if (joint.type == model::JointType::kRevolute) {
      WarnOfDegrees(*expr, *limits);
    }
  }

  /// Nothing that is limited turns round so often; degrees would.
  void WarnOfDegrees(const Expr& expr, const Interval& limits) {
    constexpr double kMostTurns = 4.0;
    const double turns =
        std::max(std::abs(limits.lower), std::abs(limits.upper)) / (2.0 * std::numbers::pi);
    if (turns <= kMostTurns) return;
    scope_.diagnostics
        .Warning(expr.span, fmt::format("joint '{}' may turn round {} times: limits are in radians",
                                        decl_.name.text, NumberText(std::floor(turns))))
        .hint = fmt::format("if these are degrees, write [{}*pi/180, {}*pi/180]",
                            NumberText(limits.lower), NumberText(limits.upper));
  }

  /// What its motor has of play and delay; a fixed joint has no motor.
  void CheckServo(model::Joint& joint, bool typed) {
    for (const char* name : {"backlash", "delay"}) {
      const Attribute* given = decl_.Find(name);
      if (given != nullptr && typed && joint.type == model::JointType::kFixed) {
        scope_.diagnostics.Error(given->key.span, fmt::format("a fixed joint has no {}", name));
      } else {
        CheckNumber(model::AttributeNamed<model::Joint>(name), scope_, &attributes_, &joint);
      }
    }
  }

  /// One half of a pair: (link, axis). False if it is of no use, reported or not.
  bool CheckHalf(const Expr& half, int& link, const AxisSymbol*& axis) {
    if (half.kind != ExprKind::kTuple || half.children.size() != 2 ||
        SingleName(half.children[0]).empty() || SingleName(half.children[1]).empty()) {
      scope_.diagnostics.Error(half.span, "expected a link and an axis").hint =
          "write pair=((linkA, axisA), (linkB, axisB))";
      return false;
    }
    // Both names are looked up before anything is reported, so that one wrong half gives all its
    // errors.
    const CheckedModule& module = scope_.module;
    const std::string link_name = SingleName(half.children[0]);
    const std::string axis_name = SingleName(half.children[1]);
    link = module.type.FindLink(link_name).value_or(-1);
    const auto it = module.axes.find(axis_name);
    if (link < 0 && !scope_.names_lost) {
      scope_.diagnostics.Error(half.children[0].span, "there is no link '" + link_name + "'").hint =
          NameHint(link_name, NamesOf(module.type.links), "links are");
    }
    if (it == module.axes.end() && !scope_.names_lost) {
      scope_.diagnostics.Error(half.children[1].span, "there is no axis '" + axis_name + "'").hint =
          NameHint(axis_name, NamesOf(module.axes), "axes are");
    }
    if (it != module.axes.end()) axis = &it->second;
    return link >= 0 && axis != nullptr && axis->valid;
  }

  /// The `pair`: two links of the module, each with the axis that the joint has in it.
  bool CheckPair(model::Joint& joint) {
    const std::string hint = "write pair=((linkA, axisA), (linkB, axisB))";
    const Expr* pair = attributes_.Required("pair", hint);
    if (!pair) return false;
    if (pair->kind != ExprKind::kTuple || pair->children.size() != 2) {
      scope_.diagnostics.Error(pair->span, "'pair' needs two links with their axes").hint = hint;
      return false;
    }
    // Until both halves are read no link is known.
    joint.link_a = joint.link_b = -1;
    const AxisSymbol* a = nullptr;
    const AxisSymbol* b = nullptr;
    const bool first = CheckHalf(pair->children[0], joint.link_a, a);
    const bool second = CheckHalf(pair->children[1], joint.link_b, b);
    if (joint.link_a >= 0 && joint.link_a == joint.link_b) {
      scope_.diagnostics.Error(pair->span, "a joint needs two different links");
      return false;
    }
    if (!first || !second) return false;
    // The first axis is the joint's; the second only has to be the same line seen from the other
    // link.
    joint.p_MoJo_M = a->p_MoAo_M;
    joint.axis = a->direction;
    CheckOpposite(*pair, *a, *b);
    return true;
  }

  /// The two axes must lie on one line and point opposite ways: each points out of its link.
  void CheckOpposite(const Expr& pair, const AxisSymbol& a, const AxisSymbol& b) {
    const Eigen::Vector3d opposite = -b.direction;
    // The angle by atan2 is exact for small angles, where acos is not.
    const double angle = std::atan2(a.direction.cross(opposite).norm(), a.direction.dot(opposite));
    // The distance of b's origin from a's line: the cross product with a unit vector has its
    // length.
    const double distance = a.direction.cross(b.p_MoAo_M - a.p_MoAo_M).norm();
    // Joint axes may be the only geometry there is; then the distance is compared with a metre.
    const double extent = scope_.module.extent_m > 0.0 ? scope_.module.extent_m : 1.0;
    if (angle <= kAxisTolerance && distance <= kAxisTolerance * extent) return;
    source::Diagnostic& d = scope_.diagnostics.Error(
        pair.span,
        fmt::format("the axes of joint '{}' are not collinear and opposite: {} degrees "
                    "off, {} m apart",
                    decl_.name.text, NumberText(std::round(angle / std::numbers::pi * 180e6) / 1e6),
                    NumberText(distance)));
    if (std::numbers::pi - angle <= kAxisTolerance)
      d.hint = "they point the same way: turn one of them round";
    d.notes.push_back({a.span, "the first axis"});
    d.notes.push_back({b.span, "the second axis"});
  }

  ModuleScope& scope_;
  const JointDecl& decl_;
  AttributeReader attributes_;
};

/// The joints of a module must make one tree of its links: poses follow from joint values alone.
void CheckTree(ModuleScope& scope) {
  const model::ModuleType& type = scope.module.type;
  // Groups of links that joints hold together; a joint within one group closes a loop.
  DisjointSets groups(static_cast<int>(type.links.size()));
  for (const model::Joint& joint : type.joints) {
    // Two links that hang together already are joined once more.
    if (!groups.Unite(joint.link_a, joint.link_b)) {
      const auto& decls = scope.module.decl->joints;
      const auto decl = std::find_if(decls.begin(), decls.end(),
                                     [&](const JointDecl& d) { return d.name.text == joint.name; });
      scope.diagnostics
          .Error(decl->name.span, "joint '" + joint.name + "' closes a loop inside the module")
          .hint = "the links of a module hang together as a tree";
    }
  }
  // A joint cannot say which of two links of one name it means; that the name is taken has been
  // said.
  std::set<std::string> names;
  for (const model::Link& link : type.links) names.insert(link.name);
  if (names.size() < type.links.size()) return;
  for (int i = 1; i < static_cast<int>(type.links.size()); ++i) {
    if (groups.Find(i) == groups.Find(0)) continue;
    scope.diagnostics
        .Error(scope.module.decl->links[i].name.span,
               fmt::format("link '{}' is joined to '{}' by no joint", type.links[i].name,
                           type.links[0].name))
        .hint = "add a joint; type=fixed holds two links together";
    return;
  }
}

}  // namespace

AxisSymbol CheckAxis(const Declaration& decl, const std::string& what, double unit_m,
                     source::Diagnostics* diagnostics) {
  AxisSymbol axis;
  axis.span = decl.name.span;
  AttributeReader attributes(decl, what, {"origin", "direction"}, diagnostics);
  const Expr* origin = attributes.Required("origin", "write origin=(x, y, z)");
  const Expr* direction = attributes.Required("direction", "write direction=(x, y, z)");
  const auto o = origin ? EvaluateVector(*origin, "origin", diagnostics) : std::nullopt;
  const auto d = direction ? EvaluateVector(*direction, "direction", diagnostics) : std::nullopt;
  // A direction so short is taken for zero: it says nothing after rounding.
  if (d && !(d->stableNorm() > 1e-12)) {
    diagnostics->Error(direction->span, what + " has a direction of length zero");
    return axis;
  }
  if (!o || !d) return axis;
  axis.p_MoAo_M = *o * unit_m;
  axis.direction = d->stableNormalized();
  axis.valid = axis.p_MoAo_M.cwiseAbs().maxCoeff() <= kMaxCoordinate_m;
  if (!axis.valid) diagnostics->Error(origin->span, "'origin' lies more than 1e6 metres away");
  return axis;
}

void CheckAxes(ModuleScope& scope) {
  for (const AxisDecl& axis : scope.module.decl->axes) {
    scope.module.axes.emplace(axis.name.text, CheckAxis(axis, "axis '" + axis.name.text + "'",
                                                        scope.unit_m, &scope.diagnostics));
  }
}

void CheckJoints(ModuleScope& scope) {
  const ModuleDecl& decl = *scope.module.decl;
  const int errors = scope.diagnostics.error_count();
  bool broken = scope.names_lost;
  for (const JointDecl& joint : decl.joints) {
    JointChecker(scope, joint).Check();
    broken = broken || joint.broken;
  }
  // Only with all joints known can it be said that one is missing.
  const bool complete = scope.module.type.joints.size() == decl.joints.size();
  if (!broken && complete && errors == scope.diagnostics.error_count()) CheckTree(scope);
}

}  // namespace morphbus::m3l::internal
