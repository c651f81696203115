#include "compiler/m3l/check_condition.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "compiler/m3l/check_slips.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l::internal {
namespace {

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
  explicit ConditionChecker(const ConditionScope& scope)
      : scope_(scope), slips_(&scope.diagnostics) {}

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
      // A member without a binder has been reported already, unless a connector of it is named.
      if (member.binder.text.empty() && !member.names_connector) return std::nullopt;
      source::Diagnostic& error =
          scope_.diagnostics.Error(name.span, "'" + name.text + "' is a whole module");
      if (!member.binder.text.empty()) {
        return error.Hint("its connector is called '" + member.binder.text + "' here");
      }
      const auto& connectors = member.module->type.connectors;
      if (connectors.empty()) return error;
      return error.Hint("name one of its connectors: " + name.text + "." + connectors[0].name);
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
    // A connector is bound to one name, or named by two: that of its member and its own.
    const std::optional<solver::Side> named = NamedMember(expr);
    const size_t words = named ? 2 : 1;
    if (expr.kind != ExprKind::kPath || expr.path.size() > words + 1) {
      return scope_.diagnostics.Error(expr.span, "expected a point, such as p_a._1");
    }
    const std::optional<solver::Side> side = named ? named : FindBinder(expr.path[0]);
    if (!side || (named && !FindConnector(*side, expr.path[1]))) return std::nullopt;
    ref.side = *side;
    if (named) ref.connector = expr.path[1].text;
    if (expr.path.size() == words) return ref;
    const Name& last = expr.path[words];
    ref.kind = PointRef::Kind::kAnySubpoint;
    if (last.text == "point") return ref;
    // A sub-point need not be on every connector, but must be on some.
    ref.kind = PointRef::Kind::kSubpoint;
    ref.subpoint = last.text;
    std::vector<std::string> names;
    for (const model::Connector& c : MemberOf(*side).module->type.connectors) {
      if (named && c.name != ref.connector) continue;
      names.insert(names.end(), c.subpoint_names.begin(), c.subpoint_names.end());
    }
    if (std::find(names.begin(), names.end(), ref.subpoint) != names.end()) return ref;
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    ReportMissing(last, "sub-point", *side, names, ref.connector);
    return std::nullopt;
  }

  /// The member whose connector a path names, as in `a.c1` and `a.c1._2`; nothing for a path that
  /// begins with a bound name.
  std::optional<solver::Side> NamedMember(const Expr& expr) {
    if (expr.kind != ExprKind::kPath || expr.path.size() < 2) return std::nullopt;
    const std::string& first = expr.path[0].text;
    for (const solver::Side side : {solver::Side::kA, solver::Side::kB}) {
      if (MemberOf(side).binder.text == first) return std::nullopt;
    }
    for (const solver::Side side : {solver::Side::kA, solver::Side::kB}) {
      if (MemberOf(side).name.text == first) return side;
    }
    return std::nullopt;
  }

  /// Whether the member has this connector; reports it if not.
  bool FindConnector(solver::Side side, const Name& name) {
    const CheckedModule& module = *MemberOf(side).module;
    if (module.type.FindConnector(name.text)) return true;
    if (!module.valid) return false;  // What is missing may be what did not parse.
    scope_.diagnostics
        .Error(name.span,
               fmt::format("module '{}' has no connector '{}'", module.type.name, name.text))
        .hint = NameHint(name.text, NamesOf(module.type.connectors), "connectors are");
    return false;
  }

  /// Reports a sub-point or attribute that no connector of the module has, or not the one called
  /// `connector`.
  void ReportMissing(const Name& name, const std::string& what, solver::Side side,
                     const std::vector<std::string>& names, const std::string& connector) {
    const CheckedModule& module = *MemberOf(side).module;
    if (!module.valid) return;  // What is missing may be what did not parse.
    const std::string text =
        connector.empty()
            ? fmt::format("no connector of '{}' has {} '{}'", module.type.name, what, name.text)
            : fmt::format("connector '{}' of '{}' has no {} '{}'", connector, module.type.name,
                          what, name.text);
    scope_.diagnostics.Error(name.span, text).hint = NameHint(name.text, names, what + "s are");
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
      if (member.module->type.FindConnector(expr.path[1].text)) break;
      std::vector<std::string> names = NamesOf(member.module->axes);
      for (const model::Connector& c : member.module->type.connectors) names.push_back(c.name);
      return scope_.diagnostics
          .Error(expr.path[1].span, fmt::format("module '{}' has no axis and no connector '{}'",
                                                member.module->type.name, expr.path[1].text))
          .Hint(NameHint(expr.path[1].text, names, "they are"));
    }
    // Everything else is a point, which has to have a normal on some connector.
    std::optional<PointRef> ref = CheckPointRef(expr);
    if (!ref) return ref;
    const CheckedModule& module = *MemberOf(ref->side).module;
    bool found = false;
    for (size_t i = 0; i < module.directions.size(); ++i) {
      const auto& directions = module.directions[i];
      if (!ref->connector.empty() && module.type.connectors[i].name != ref->connector) continue;
      const bool any = ref->kind == PointRef::Kind::kAnySubpoint;
      found = found || (any ? directions.size() > directions.count("")
                            : directions.count(ref->subpoint) > 0);
    }
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
    // `a.c1.gender` is an attribute of a named connector; `a.gender` says of none whose it is.
    std::optional<solver::Side> side = NamedMember(expr);
    const bool named = side && (expr.path.size() > 2 ||
                                MemberOf(*side).module->type.FindConnector(expr.path[1].text));
    if (!named) side = FindBinder(expr.path[0]);
    if (!side || (named && !FindConnector(*side, expr.path[1]))) return std::nullopt;
    const size_t words = named ? 2 : 1;
    if (expr.path.size() != words + 1) {
      const std::string whose = expr.path[0].text + (named ? "." + expr.path[1].text : "");
      return scope_.diagnostics.Error(expr.span, "expected an attribute")
          .Hint("such as " + whose + ".gender");
    }
    return FindAttribute(*side, expr, named ? expr.path[1].text : "");
  }

  /// The attribute or state variable on any connector of the member; its type is that of the last
  /// fixed one, or else of the first state.
  /// @param named  the connector that must have it; empty: any.
  std::optional<CheckedOperand> FindAttribute(solver::Side side, const Expr& expr,
                                              const std::string& named) {
    const Name& key = expr.path.back();
    CheckedOperand found{solver::AttributeRef{side, key.text, named}, {}, {}, expr.span};
    std::vector<std::string> names;
    bool any = false, fixed = false;
    for (const model::Connector& connector : MemberOf(side).module->type.connectors) {
      if (!named.empty() && connector.name != named) continue;
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
      if (named.empty()) slips_.WarnOf(*MemberOf(side).module, key.text, expr.span);
      return found;
    }
    // The hint lists each name once.
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    ReportMissing(key, "attribute", side, names, named);
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

  const ConditionScope& scope_;
  std::set<std::pair<const CheckedModule*, std::string>> without_normal_;
  SlipWarner slips_;
};

/// Finds the binders `a.point p` below `expr`, in source order, and reports what cannot be one.
void CollectFrom(const Expr& expr, ConditionScope& scope) {
  for (const Expr& child : expr.children) CollectFrom(child, scope);
  if (expr.kind == ExprKind::kPath && expr.path.size() >= 2) {
    for (ConditionScope::Member& m : scope.members) {
      // What is behind the name of a member is an axis of it, or meant for a connector.
      const bool axis = m.module->axes.count(expr.path[1].text) > 0;
      if (m.name.text == expr.path[0].text && !axis) m.names_connector = true;
    }
  }
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
    if (!member.binder.text.empty() || member.names_connector) continue;
    scope.diagnostics.Error(name, "the conditions name no connector of '" + member.name.text + "'")
        .hint = fmt::format(
        "write {0}.point p_{0} where it is first used, or one by its name, such as {0}.{1}",
        member.name.text,
        member.module->type.connectors.empty() ? "c1" : member.module->type.connectors[0].name);
  }
}

std::optional<Condition> CheckCondition(const Expr& expr, const ConditionScope& scope) {
  return ConditionChecker(scope).Check(expr);
}

}  // namespace morphbus::m3l::internal
