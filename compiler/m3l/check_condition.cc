#include "compiler/m3l/check_condition.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

/// Warnings of slips that one connection gives; more would say nothing new.
constexpr size_t kMaxSlips = 20;

using solver::CompareOp;
using solver::Condition;
using solver::PointRef;

/// What kind of value it is, for messages.
const char* TypeText(const model::AttributeValue& value) {
  if (std::holds_alternative<bool>(value)) return "true or false";
  return std::holds_alternative<double>(value) ? "a number" : "a string";
}

/// Checks the condition of one connection, node by node; a node with an error has no value, and
/// says nothing more.
class ConditionChecker {
 public:
  explicit ConditionChecker(const ConditionScope& scope) : scope_(scope) {}

  /// The condition that `outer` writes; parentheses around it do not matter.
  std::optional<Condition> Check(const Expr& outer) {
    const Expr& expr = Unwrapped(outer);
    switch (expr.kind) {
      case ExprKind::kAnd:
        return CheckJunction(expr, Condition::Kind::kAnd);
      case ExprKind::kOr:
        return CheckJunction(expr, Condition::Kind::kOr);
      case ExprKind::kNot:
        return CheckJunction(expr, Condition::Kind::kNot);
      case ExprKind::kRelation:
        return CheckRelation(expr);
      case ExprKind::kTyped:
        return Constant(true, expr);  // `a.point p` names a connector, and always holds.
      case ExprKind::kPath:
        return CheckFlag(expr);
      default:
        break;
    }
    return scope_.diagnostics.Error(expr.span, "expected a condition")
        .Hint("such as: p_a coincident p_b, p_a.gender==\"male\"; joined with and, or, not");
  }

 private:
  static Condition Make(Condition::Kind kind, const Expr& expr) {
    Condition condition;
    condition.kind = kind;
    condition.span = expr.span;
    return condition;
  }

  /// A condition that always holds, or never: `not` of what always holds.
  static Condition Constant(bool value, const Expr& expr) {
    Condition condition;
    condition.span = expr.span;
    if (value) return condition;
    condition.kind = Condition::Kind::kNot;
    // A fresh condition always holds.
    condition.children.emplace_back();
    condition.children[0].span = expr.span;
    return condition;
  }

  /// `and`, `or`, `not`: all children are checked, so that each of their errors is found.
  std::optional<Condition> CheckJunction(const Expr& expr, Condition::Kind kind) {
    Condition condition = Make(kind, expr);
    for (const Expr& child : expr.children) {
      std::optional<Condition> part = Check(child);
      if (part) condition.children.push_back(std::move(*part));
    }
    if (condition.children.size() != expr.children.size()) return std::nullopt;
    return condition;
  }

  /// `coincident`, `parallel`, `antiparallel` between points or directions; other relations compare
  /// attributes.
  std::optional<Condition> CheckRelation(const Expr& expr) {
    // The relations between points and directions are words, those between attributes are signs.
    const bool coincident = expr.text == "coincident";
    if (!coincident && expr.text != "parallel" && expr.text != "antiparallel") {
      return CheckComparison(expr);
    }
    Condition condition = Make(coincident                ? Condition::Kind::kCoincident
                               : expr.text == "parallel" ? Condition::Kind::kParallel
                                                         : Condition::Kind::kAntiparallel,
                               expr);
    const auto p = coincident ? CheckPointRef(expr.children[0]) : CheckDirection(expr.children[0]);
    const auto q = coincident ? CheckPointRef(expr.children[1]) : CheckDirection(expr.children[1]);
    if (!p || !q) return std::nullopt;
    // A relation within one module would not place the other.
    if (p->side == q->side) {
      return scope_.diagnostics
          .Error(expr.span, "both sides belong to member '" + MemberOf(p->side).name.text + "'")
          .Hint("a condition relates one member to the other");
    }
    const bool any = p->kind == PointRef::Kind::kAnySubpoint;
    if (any && q->kind == PointRef::Kind::kAnySubpoint) {
      return scope_.diagnostics.Error(expr.span, "one side must be a particular point")
          .Hint("such as " + MemberOf(p->side).binder.text + "._1");
    }
    condition.p = *p;
    condition.q = *q;
    return condition;
  }

  /// The member that plays `side`.
  const ConditionScope::Member& MemberOf(solver::Side side) const {
    return scope_.members[side == solver::Side::kA ? 0 : 1];
  }

  /// The member that a path's first name is the binder of; reports what is not.
  std::optional<solver::Side> FindBinder(const Name& name) {
    for (const solver::Side side : {solver::Side::kA, solver::Side::kB}) {
      if (!name.text.empty() && MemberOf(side).binder.text == name.text) return side;
    }
    for (const solver::Side side : {solver::Side::kA, solver::Side::kB}) {
      const ConditionScope::Member& member = MemberOf(side);
      if (member.name.text != name.text) continue;
      // A member without a binder has been reported already.
      if (member.binder.text.empty()) return std::nullopt;
      return scope_.diagnostics.Error(name.span, "'" + name.text + "' is a whole module")
          .Hint("its connector is called '" + member.binder.text + "' here");
    }
    // The name is neither a binder nor a member.
    std::vector<std::string> names;
    for (const ConditionScope::Member& member : scope_.members) {
      if (!member.binder.text.empty()) names.push_back(member.binder.text);
    }
    if (names.empty()) return std::nullopt;
    return scope_.diagnostics.Error(name.span, "unknown name '" + name.text + "'")
        .Hint(NameHint(name.text, names, "names are"));
  }

  /// A point of a member's connector: `p`, `p.point` for any of its sub-points, `p._1`, or the
  /// typed name that binds it.
  std::optional<PointRef> CheckPointRef(const Expr& outer) {
    const Expr& expr = Unwrapped(outer);
    PointRef ref;
    if (expr.kind == ExprKind::kTyped) {
      // CollectBinders has seen to it that the name is that of one of the members.
      const bool of_a = MemberOf(solver::Side::kA).name.text == expr.path[0].text;
      ref.side = of_a ? solver::Side::kA : solver::Side::kB;
      return ref;
    }
    if (expr.kind != ExprKind::kPath || expr.path.size() > 2) {
      return scope_.diagnostics.Error(expr.span, "expected a point, such as p_a._1");
    }
    const std::optional<solver::Side> side = FindBinder(expr.path[0]);
    if (!side) return std::nullopt;
    ref.side = *side;
    if (expr.path.size() == 1) return ref;
    ref.kind = PointRef::Kind::kAnySubpoint;
    if (expr.path[1].text == "point") return ref;
    // A sub-point need not be on every connector, but must be on some.
    ref.kind = PointRef::Kind::kSubpoint;
    ref.subpoint = expr.path[1].text;
    std::vector<std::string> names;
    for (const model::Connector& c : MemberOf(*side).module->type.connectors) {
      names.insert(names.end(), c.subpoint_names.begin(), c.subpoint_names.end());
    }
    if (std::find(names.begin(), names.end(), ref.subpoint) != names.end()) return ref;
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    ReportMissing(expr.path[1], "sub-point", *side, names);
    return std::nullopt;
  }

  /// Reports a sub-point or attribute that no connector of the module has.
  void ReportMissing(const Name& name, const std::string& what, solver::Side side,
                     const std::vector<std::string>& names) {
    const CheckedModule& module = *MemberOf(side).module;
    if (!module.valid) return;  // What is missing may be what did not parse.
    scope_.diagnostics
        .Error(name.span,
               fmt::format("no connector of '{}' has {} '{}'", module.type.name, what, name.text))
        .hint = NameHint(name.text, names, what + "s are");
  }

  /// A point with a normal, or an axis `a.axis_name` of a member.
  std::optional<PointRef> CheckDirection(const Expr& outer) {
    const Expr& expr = Unwrapped(outer);
    // `a.up`, with a member's name, is an axis of the module; a binder of the same name goes
    // before.
    for (const solver::Side side : {solver::Side::kA, solver::Side::kB}) {
      const ConditionScope::Member& member = MemberOf(side);
      if (expr.kind != ExprKind::kPath || expr.path.size() != 2 ||
          expr.path[0].text != member.name.text || expr.path[0].text == member.binder.text) {
        continue;
      }
      const auto it = member.module->axes.find(expr.path[1].text);
      if (it != member.module->axes.end()) {
        PointRef ref;
        ref.side = side;
        ref.kind = PointRef::Kind::kAxis;
        ref.subpoint = it->first;
        ref.axis = it->second.direction;
        return ref;
      }
      if (!member.module->valid) return std::nullopt;
      return scope_.diagnostics
          .Error(expr.path[1].span, fmt::format("module '{}' has no axis '{}'",
                                                member.module->type.name, expr.path[1].text))
          .Hint(NameHint(expr.path[1].text, NamesOf(member.module->axes), "axes are"));
    }
    // Everything else is a point, which has to have a normal on some connector.
    std::optional<PointRef> ref = CheckPointRef(expr);
    if (!ref) return ref;
    if (ref->kind == PointRef::Kind::kAnySubpoint) {
      return scope_.diagnostics.Error(expr.span, "a direction needs a particular point or axis");
    }
    const CheckedModule& module = *MemberOf(ref->side).module;
    const auto& connectors = module.type.connectors;
    const bool found =
        std::any_of(connectors.begin(), connectors.end(),
                    [&](const model::Connector& c) { return c.normals.count(ref->subpoint) > 0; });
    // A normal may be missing on some connectors, but not on all.
    if (found || !module.valid) return found ? ref : std::nullopt;
    // Both sides of a condition between modules of one type lack the same normals: said once.
    if (!without_normal_.emplace(&module, ref->subpoint).second) return std::nullopt;
    return scope_.diagnostics
        .Error(expr.span, "no connector of '" + module.type.name + "' has a normal at this point")
        .Hint("give it one: normal=(0, 0, 1)");
  }

  // --- Comparisons of attributes ---

  /// An operand with a value that stands for its type, and the values it can take if few are known.
  struct CheckedOperand {
    solver::Operand operand;
    model::AttributeValue sample;
    std::vector<model::AttributeValue> states;  ///< Not empty: always a free state variable.
    source::Span span;
  };

  /// One side of a comparison: a constant, or an attribute `p.name`.
  std::optional<CheckedOperand> CheckOperand(const Expr& outer) {
    const Expr& expr = Unwrapped(outer);
    const std::string name = SingleName(expr);
    // `true`, `false`, `pi` and constants look like paths, but are values.
    const bool constant = name == "true" || name == "false" || name == "pi" || expr.constant;
    if (expr.kind != ExprKind::kPath || constant) {
      const auto value = EvaluateAttribute(expr, &scope_.diagnostics);
      if (!value) return std::nullopt;
      return CheckedOperand{*value, *value, {}, expr.span};
    }
    const std::optional<solver::Side> side = FindBinder(expr.path[0]);
    if (!side) return std::nullopt;
    if (expr.path.size() != 2) {
      return scope_.diagnostics.Error(expr.span, "expected an attribute")
          .Hint("such as " + expr.path[0].text + ".gender");
    }
    return FindAttribute(*side, expr);
  }

  /// The attribute or state variable on any connector of the member; its type is that of the last
  /// fixed one, or else of the first state.
  std::optional<CheckedOperand> FindAttribute(solver::Side side, const Expr& expr) {
    const Name& key = expr.path[1];
    CheckedOperand found{solver::AttributeRef{side, key.text}, {}, {}, expr.span};
    std::vector<std::string> names;
    bool any = false, fixed = false;
    for (const model::Connector& connector : MemberOf(side).module->type.connectors) {
      for (const auto& [name, value] : connector.attributes) {
        names.push_back(name);
        if (name != key.text) continue;
        found.sample = value;
        any = fixed = true;
      }
      for (const model::StateVariable& state : connector.states) {
        names.push_back(state.name);
        if (state.name != key.text) continue;
        if (!fixed) found.sample = state.values[0];
        found.states.insert(found.states.end(), state.values.begin(), state.values.end());
        any = true;
      }
    }
    // A connector on which it is fixed may have any value, whatever those take on which it is free.
    if (fixed) found.states.clear();
    if (any) {
      WarnOfSlips(side, expr);
      return found;
    }
    // The hint lists each name once.
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    ReportMissing(key, "attribute", side, names);
    return std::nullopt;
  }

  /// `==`, `<` and the like: both sides of one type, order among numbers only.
  std::optional<Condition> CheckComparison(const Expr& expr) {
    static const std::map<std::string, CompareOp> kOps = {
        {"==", CompareOp::kEq}, {"!=", CompareOp::kNe}, {"<", CompareOp::kLt},
        {"<=", CompareOp::kLe}, {">", CompareOp::kGt},  {">=", CompareOp::kGe}};
    const std::optional<CheckedOperand> lhs = CheckOperand(expr.children[0]);
    // Both sides are checked, so that the errors of each are found.
    const std::optional<CheckedOperand> rhs = CheckOperand(expr.children[1]);
    if (!lhs || !rhs) return std::nullopt;
    if (lhs->sample.index() != rhs->sample.index()) {
      return scope_.diagnostics.Error(
          expr.span,
          fmt::format("{} is compared with {}", TypeText(lhs->sample), TypeText(rhs->sample)));
    }
    Condition condition = Make(Condition::Kind::kCompare, expr);
    condition.op = kOps.at(expr.text);
    condition.lhs = lhs->operand;
    condition.rhs = rhs->operand;
    // Strings and flags are equal or not, but neither is less.
    const bool order = condition.op != CompareOp::kEq && condition.op != CompareOp::kNe;
    if (order && !std::holds_alternative<double>(lhs->sample)) {
      return scope_.diagnostics.Error(expr.span, "only numbers have an order").Hint("use == or !=");
    }
    if (!CheckStateValue(*lhs, *rhs) || !CheckStateValue(*rhs, *lhs)) return std::nullopt;
    return condition;
  }

  /// A state variable compared with a value that it never has is a slip.
  bool CheckStateValue(const CheckedOperand& state, const CheckedOperand& other) {
    const auto* value = std::get_if<model::AttributeValue>(&other.operand);
    if (state.states.empty() || value == nullptr) return true;
    if (std::find(state.states.begin(), state.states.end(), *value) != state.states.end()) {
      return true;
    }
    // Connectors may list the same values; each is named once in the hint.
    std::vector<std::string> texts;
    for (const model::AttributeValue& v : state.states) {
      const std::string text = ValueText(v);
      if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
    }
    scope_.diagnostics.Error(other.span, "the state never is " + ValueText(*value)).hint =
        fmt::format("its values are {}", fmt::join(texts, ", "));
    return false;
  }

  /// `p_a.extended` alone means that it is true.
  std::optional<Condition> CheckFlag(const Expr& expr) {
    const std::string name = SingleName(expr);
    if (name == "true" || name == "false") return Constant(name == "true", expr);
    const std::optional<CheckedOperand> operand = CheckOperand(expr);
    if (!operand) return std::nullopt;
    // A flag alone is a condition; a literal, or an attribute of another type, says nothing yet.
    if (!std::holds_alternative<bool>(operand->sample) ||
        std::holds_alternative<model::AttributeValue>(operand->operand)) {
      return scope_.diagnostics.Error(expr.span, "expected a condition")
          .Hint("compare it, as in: " + PathText(expr.path) + "==...");
    }
    Condition condition = Make(Condition::Kind::kCompare, expr);
    condition.lhs = operand->operand;
    condition.rhs = model::AttributeValue(true);
    return condition;
  }

  // --- Slips in keys of connectors

  /// Where the connector is declared: at the module or at a link.
  static const PointDecl* DeclOf(const CheckedModule& module, const std::string& connector) {
    const auto point = module.points.find(connector);
    if (point != module.points.end() && point->second.connector) return point->second.decl;
    for (const auto& own : module.link_points) {
      const auto it = own.find(connector);
      if (it != own.end() && it->second.connector) return it->second.decl;
    }
    return nullptr;
  }

  /// A connector without the key, but with one that is nearly the same, would silently never mate.
  void WarnOfSlips(solver::Side side, const Expr& expr) {
    const std::string& key = expr.path[1].text;
    const CheckedModule& module = *MemberOf(side).module;
    // A condition may name one key several times, and both members may be of one type: looked for
    // once.
    if (!looked_for_slips_.emplace(&module, key).second) return;
    const std::map<std::string, int>& uses = UsesOfKeys(module);
    for (const model::Connector& connector : module.type.connectors) {
      const PointDecl* decl = DeclOf(module, connector.name);
      if (decl == nullptr || decl->Find(key) != nullptr) continue;
      for (const Attribute& attribute : decl->attributes) {
        const std::string& other = attribute.key.text;
        // A key that other connectors have too is meant.
        if (other == "coords" || other == "normal" || other == "connector" || uses.at(other) > 1 ||
            source::NearestName(other, {key}).empty() || slips_.size() >= kMaxSlips ||
            !slips_.emplace(attribute.key.span.file, attribute.key.span.begin).second) {
          continue;
        }
        scope_.diagnostics
            .Warning(attribute.key.span,
                     fmt::format("connector '{}' has no '{}' for a condition to hold, only '{}'",
                                 connector.name, key, other))
            .Hint(fmt::format("did you mean '{}'?", key))
            .Note(expr.span, "the condition is false for the connector without it");
      }
    }
  }

  /// How many of a module's connectors have each key.
  const std::map<std::string, int>& UsesOfKeys(const CheckedModule& module) {
    const auto [it, fresh] = uses_of_keys_.try_emplace(&module);
    if (!fresh) return it->second;
    for (const model::Connector& connector : module.type.connectors) {
      const PointDecl* decl = DeclOf(module, connector.name);
      if (decl == nullptr) continue;
      std::set<std::string> keys;  // A key that is given twice counts once.
      for (const Attribute& attribute : decl->attributes) keys.insert(attribute.key.text);
      for (const std::string& key : keys) ++it->second[key];
    }
    return it->second;
  }

  const ConditionScope& scope_;
  std::set<std::pair<const CheckedModule*, std::string>> without_normal_;
  std::set<std::pair<int, size_t>> slips_;  ///< Places of keys that were warned of.
  std::set<std::pair<const CheckedModule*, std::string>> looked_for_slips_;
  std::map<const CheckedModule*, std::map<std::string, int>> uses_of_keys_;
};

/// Finds the binders `a.point p` below `expr`, in source order, and reports what cannot be one.
void CollectFrom(const Expr& expr, ConditionScope& scope) {
  for (const Expr& child : expr.children) CollectFrom(child, scope);
  if (expr.kind != ExprKind::kTyped) return;
  ConditionScope::Member* member = nullptr;
  for (ConditionScope::Member& m : scope.members) {
    if (m.name.text == expr.path[0].text) member = &m;
  }
  // Only `MEMBER.point NAME` binds: the connector of one of the two members.
  if (member == nullptr || expr.path.size() != 2 || expr.path[1].text != "point") {
    scope.diagnostics.Error(expr.span, "expected a connector of a member to name")
        .Hint(fmt::format("write {}.point {}", scope.members[0].name.text, expr.bound.text));
    return;
  }
  // Each member's connector is named once, by a name that is not taken.
  const ConditionScope::Member& other = scope.members[member == &scope.members[0] ? 1 : 0];
  const bool taken = other.binder.text == expr.bound.text || other.name.text == expr.bound.text;
  if (!member->binder.text.empty() || taken) {
    const bool twice = !member->binder.text.empty();
    scope.diagnostics
        .Error(expr.bound.span, twice
                                    ? "the connector of '" + member->name.text + "' is named twice"
                                    : "the name '" + expr.bound.text + "' is taken")
        .Note(twice                                  ? member->binder.span
              : other.binder.text == expr.bound.text ? other.binder.span
                                                     : other.name.span,
              "first named here");
    return;
  }
  member->binder = expr.bound;
}

}  // namespace

void CollectBinders(const Expr& expr, const source::Span& name, ConditionScope& scope) {
  const int errors = scope.diagnostics.error_count();
  CollectFrom(expr, scope);
  if (errors != scope.diagnostics.error_count()) return;
  for (const ConditionScope::Member& member : scope.members) {
    if (!member.binder.text.empty()) continue;
    scope.diagnostics.Error(name, "the conditions name no connector of '" + member.name.text + "'")
        .hint = fmt::format("write {0}.point p_{0} where it is first used", member.name.text);
  }
}

std::optional<Condition> CheckCondition(const Expr& expr, const ConditionScope& scope) {
  return ConditionChecker(scope).Check(expr);
}

}  // namespace morphbus::m3l::internal
