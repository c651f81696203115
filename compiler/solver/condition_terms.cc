#include "compiler/solver/condition_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace morphbus::solver {
namespace {

using model::AttributeValue;
using model::Connector;
using model::StateRequirement;

/// States that must hold together, sorted by nothing: source order.
using StateSet = std::vector<StateRequirement>;

/// The condition in negation normal form, with fixed attributes worked out.
struct Formula {
  enum class Kind { kTrue, kFalse, kAnd, kOr, kGeometry, kState };
  Kind kind = Kind::kTrue;
  std::vector<Formula> children;
  Literal literal;                     ///< kGeometry.
  std::vector<StateSet> alternatives;  ///< kState.
  bool has_geometry = false;
};

/// A formula that always holds, or never.
Formula Constant(bool value) {
  Formula f;
  f.kind = value ? Formula::Kind::kTrue : Formula::Kind::kFalse;
  return f;
}

/// Applies a comparison with the type's own == and <.
template <typename T>
bool Holds(CompareOp op, const T& lhs, const T& rhs) {
  switch (op) {
    case CompareOp::kEq:
      return lhs == rhs;
    case CompareOp::kNe:
      return !(lhs == rhs);
    case CompareOp::kLt:
      return lhs < rhs;
    case CompareOp::kLe:
      return !(rhs < lhs);
    case CompareOp::kGt:
      return rhs < lhs;
    case CompareOp::kGe:
      return !(lhs < rhs);
  }
  return false;
}

/// Compares two values; values of unlike types differ and have no order.
bool Compare(CompareOp op, const AttributeValue& lhs, const AttributeValue& rhs) {
  if (lhs.index() != rhs.index()) return op == CompareOp::kNe;
  return std::visit(
      [&](const auto& value) {
        return Holds(op, value, std::get<std::decay_t<decltype(value)>>(rhs));
      },
      lhs);
}

/// The values an operand may take, each with the state that brings it about.
struct Possibility {
  AttributeValue value;
  std::optional<StateRequirement> state;
};

/// Turns a condition into a Formula for one pair of connectors: fixed attributes and missing points
/// become constants, states become alternatives, geometry stays.
class Specialiser {
 public:
  Specialiser(const Connector& a, const Connector& b) : a_(a), b_(b) {}

  /// The formula of `condition`, or of its negation: `not` is pushed down to the leaves on the way.
  [[nodiscard]] Formula Build(const Condition& condition, bool negate) const {
    switch (condition.kind) {
      case Condition::Kind::kTrue:
        return Constant(!negate);
      case Condition::Kind::kNot:
        return condition.children.empty() ? Constant(!negate)
                                          : Build(condition.children[0], !negate);
      case Condition::Kind::kAnd:
      case Condition::Kind::kOr:
        return BuildList(condition, negate);
      case Condition::Kind::kCompare:
        return BuildCompare(condition, negate);
      default:
        break;
    }
    // What a connector lacks makes the condition on it false (docs/m3l.md, connections).
    if (!Exists(condition.p) || !Exists(condition.q)) return Constant(negate);
    if (condition.kind != Condition::Kind::kCoincident &&
        (!HasDirection(condition.p) || !HasDirection(condition.q))) {
      return Constant(negate);
    }
    // What is left is geometry, which the solver has to look at.
    Formula f;
    f.kind = Formula::Kind::kGeometry;
    f.literal = {&condition, negate};
    f.has_geometry = true;
    return f;
  }

 private:
  [[nodiscard]] const Connector& On(Side side) const { return side == Side::kA ? a_ : b_; }

  /// True if the connector has the point that `ref` names.
  [[nodiscard]] bool Exists(const PointRef& ref) const {
    const std::vector<std::string>& names = On(ref.side).subpoint_names;
    switch (ref.kind) {
      case PointRef::Kind::kSubpoint:
        return std::find(names.begin(), names.end(), ref.subpoint) != names.end();
      case PointRef::Kind::kAnySubpoint:
        return !names.empty();
      default:
        return true;
    }
  }

  /// True if `ref` has a direction: an axis has, a point if it has a normal.
  [[nodiscard]] bool HasDirection(const PointRef& ref) const {
    if (ref.kind == PointRef::Kind::kAxis) return true;
    const std::string key = ref.kind == PointRef::Kind::kSubpoint ? ref.subpoint : "";
    return On(ref.side).normals.count(key) > 0;
  }

  /// `and` or `or`; negation swaps the two (De Morgan). Constants are folded.
  [[nodiscard]] Formula BuildList(const Condition& condition, bool negate) const {
    const bool is_and = (condition.kind == Condition::Kind::kAnd) != negate;
    const Formula::Kind absorbing = is_and ? Formula::Kind::kFalse : Formula::Kind::kTrue;
    const Formula::Kind neutral = is_and ? Formula::Kind::kTrue : Formula::Kind::kFalse;
    Formula f;
    f.kind = is_and ? Formula::Kind::kAnd : Formula::Kind::kOr;
    for (const Condition& child : condition.children) {
      Formula part = Build(child, negate);
      if (part.kind == absorbing) return part;
      if (part.kind == neutral) continue;
      f.has_geometry = f.has_geometry || part.has_geometry;
      f.children.push_back(std::move(part));
    }
    if (f.children.empty()) return Constant(is_and);
    // A list of one is its child.
    if (f.children.size() == 1) {
      Formula only = std::move(f.children[0]);
      return only;
    }
    return f;
  }

  /// The values that an operand can take: one if it is fixed, those of the state variable if it is
  /// free, none if the connector has no such attribute.
  [[nodiscard]] std::vector<Possibility> PossibilitiesOf(const Operand& operand) const {
    if (const auto* value = std::get_if<AttributeValue>(&operand)) return {{*value, {}}};
    const auto& ref = std::get<AttributeRef>(operand);
    const Connector& connector = On(ref.side);
    const auto fixed = connector.attributes.find(ref.name);
    if (fixed != connector.attributes.end()) return {{fixed->second, {}}};
    std::vector<Possibility> result;
    for (const model::StateVariable& state : connector.states) {
      if (state.name != ref.name) continue;
      for (const AttributeValue& value : state.values) {
        result.push_back({value, StateRequirement{ref.side == Side::kA, ref.name, value}});
      }
    }
    return result;
  }

  /// A comparison as the combinations of states that make it hold.
  [[nodiscard]] Formula BuildCompare(const Condition& condition, bool negate) const {
    const std::vector<Possibility> lhs = PossibilitiesOf(condition.lhs);
    const std::vector<Possibility> rhs = PossibilitiesOf(condition.rhs);
    if (lhs.empty() || rhs.empty()) return Constant(negate);
    Formula f;
    f.kind = Formula::Kind::kState;
    size_t combinations = 0;
    // Every pair of values that the two sides can take is tried.
    for (const Possibility& l : lhs) {
      for (const Possibility& r : rhs) {
        // Where both sides are the same state variable, it has one value at a time.
        const bool same = l.state && r.state && l.state->of_a == r.state->of_a &&
                          l.state->variable == r.state->variable;
        if (same && l.state->value != r.state->value) continue;
        ++combinations;
        if (Compare(condition.op, l.value, r.value) == negate) continue;
        StateSet states;
        if (l.state) states.push_back(*l.state);
        if (r.state && !same) states.push_back(*r.state);
        f.alternatives.push_back(std::move(states));
      }
    }
    // If all or none of the combinations hold, no state is asked for.
    if (f.alternatives.empty()) return Constant(false);
    if (f.alternatives.size() == combinations) return Constant(true);
    return f;
  }

  const Connector& a_;
  const Connector& b_;
};

/// The union of two state sets; nothing if they contradict each other.
std::optional<StateSet> Merge(const StateSet& left, const StateSet& right) {
  StateSet merged = left;
  // A variable that both sets name must have the same value in both.
  for (const StateRequirement& r : right) {
    const auto same = std::find_if(merged.begin(), merged.end(), [&](const StateRequirement& m) {
      return m.of_a == r.of_a && m.variable == r.variable;
    });
    if (same == merged.end()) {
      merged.push_back(r);
    } else if (same->value != r.value) {
      return std::nullopt;
    }
  }
  return merged;
}

/// Disjunctive normal forms under construction; both kinds give up together.
class Expander {
 public:
  [[nodiscard]] bool too_many_terms() const { return too_many_terms_; }
  [[nodiscard]] bool too_many_states() const { return too_many_states_; }

  /// The sets of states any one of which satisfies `f`, which holds no geometry.
  std::vector<StateSet> StatesOf(const Formula& f) {
    switch (f.kind) {
      case Formula::Kind::kFalse:
        return {};
      case Formula::Kind::kState:
        return Limited(f.alternatives);
      case Formula::Kind::kOr: {
        // Any of the parts will do, so their sets are put together.
        std::vector<StateSet> all;
        for (const Formula& child : f.children) {
          for (StateSet& set : StatesOf(child)) all.push_back(std::move(set));
        }
        return Limited(std::move(all));
      }
      case Formula::Kind::kAnd: {
        // All parts must hold, so each set of one part is united with each of the next.
        std::vector<StateSet> all = {{}};
        for (const Formula& child : f.children) all = Product(all, StatesOf(child));
        return all;
      }
      default:
        return {{}};
    }
  }

  /// Geometry terms; a part without geometry stays whole and is met in `free`.
  struct OpenTerm {
    std::vector<Literal> geometry;
    std::vector<const Formula*> free;
  };
  std::vector<OpenTerm> TermsOf(const Formula& f) {
    if (f.kind == Formula::Kind::kFalse) return {};
    if (!f.has_geometry) return {OpenTerm{{}, {&f}}};
    if (f.kind == Formula::Kind::kGeometry) return {OpenTerm{{f.literal}, {}}};
    std::vector<OpenTerm> all;
    // Alternatives add up; parts that must all hold multiply, each term of the one with each of the
    // other.
    if (f.kind == Formula::Kind::kOr) {
      for (const Formula& child : f.children) {
        for (OpenTerm& term : TermsOf(child)) all.push_back(std::move(term));
        if (Exceeds(all.size())) return {};
      }
      return all;
    }
    all.push_back({});
    for (const Formula& child : f.children) {
      const std::vector<OpenTerm> parts = TermsOf(child);
      if (Exceeds(all.size() * parts.size())) return {};
      std::vector<OpenTerm> wider;
      for (const OpenTerm& left : all) {
        for (const OpenTerm& right : parts) {
          OpenTerm both = left;
          both.geometry.insert(both.geometry.end(), right.geometry.begin(), right.geometry.end());
          both.free.insert(both.free.end(), right.free.begin(), right.free.end());
          wider.push_back(std::move(both));
        }
      }
      all = std::move(wider);
    }
    return all;
  }

  /// All unions of a set of the left with one of the right that do not contradict each other.
  std::vector<StateSet> Product(const std::vector<StateSet>& left,
                                const std::vector<StateSet>& right) {
    std::vector<StateSet> result;
    for (const StateSet& l : left) {
      for (const StateSet& r : right) {
        if (std::optional<StateSet> merged = Merge(l, r)) result.push_back(std::move(*merged));
        if (result.size() > kMaxStateSets) return Limited(std::move(result));
      }
    }
    return result;
  }

 private:
  /// Notes and returns whether there are too many terms.
  bool Exceeds(size_t terms) {
    if (terms > kMaxTerms) too_many_terms_ = true;
    return too_many_terms_;
  }

  /// `sets`, or nothing and a note if there are too many of them.
  std::vector<StateSet> Limited(std::vector<StateSet> sets) {
    if (sets.size() <= kMaxStateSets) return sets;
    too_many_states_ = true;
    return {};
  }

  bool too_many_terms_ = false;
  bool too_many_states_ = false;
};

/// The parts of a condition that must all hold, in source order.
void TopLevelParts(const Condition& condition, std::vector<const Condition*>& parts) {
  if (condition.kind != Condition::Kind::kAnd) {
    parts.push_back(&condition);
    return;
  }
  for (const Condition& child : condition.children) TopLevelParts(child, parts);
}

/// Finds the first part of the condition that cannot hold for the pair; the whole if each part can.
void FindBroken(const Condition& condition, const Specialiser& specialiser, Terms& result) {
  std::vector<const Condition*> parts;
  TopLevelParts(condition, parts);
  result.broken = &condition;
  result.broken_index = static_cast<int>(parts.size());
  for (size_t i = 0; i < parts.size(); ++i) {
    if (specialiser.Build(*parts[i], false).kind == Formula::Kind::kFalse) {
      result.broken = parts[i];
      result.broken_index = static_cast<int>(i);
      return;
    }
  }
}

}  // namespace

std::vector<Eigen::Vector3d> FindPoints(const PointRef& ref, bool direction,
                                        const Connector& connector) {
  // An axis is the same for all connectors; a normal belongs to the point that it is given for.
  if (ref.kind == PointRef::Kind::kAxis) return {ref.axis.normalized()};
  if (direction) {
    const std::string key = ref.kind == PointRef::Kind::kSubpoint ? ref.subpoint : "";
    const auto normal = connector.normals.find(key);
    if (normal == connector.normals.end()) return {};
    return {normal->second};
  }
  if (ref.kind == PointRef::Kind::kCentre) return {connector.p_MoCo_M};
  if (ref.kind == PointRef::Kind::kAnySubpoint) return connector.subpoints;
  const auto& names = connector.subpoint_names;
  const auto name = std::find(names.begin(), names.end(), ref.subpoint);
  if (name == names.end()) return {};
  return {connector.subpoints[name - names.begin()]};
}

Terms SpecialiseCondition(const Condition& condition, const model::Connector& a,
                          const model::Connector& b) {
  Terms result;
  // Alternatives over geometry become terms of their own, as each is solved for itself. Parts
  // without geometry need no solving: one state that satisfies them is enough.
  const Specialiser specialiser(a, b);
  const Formula formula = specialiser.Build(condition, false);
  Expander expander;
  const std::vector<Expander::OpenTerm> open_terms = expander.TermsOf(formula);
  for (const Expander::OpenTerm& open : open_terms) {
    std::vector<StateSet> sets = {{}};
    for (const Formula* free : open.free) sets = expander.Product(sets, expander.StatesOf(*free));
    if (sets.empty()) continue;
    // Of several states that would do, the least demanding, the first in the source on ties.
    const auto least =
        std::min_element(sets.begin(), sets.end(),
                         [](const StateSet& l, const StateSet& r) { return l.size() < r.size(); });
    result.terms.push_back({open.geometry, *least});
  }
  result.too_many_terms = expander.too_many_terms();
  result.too_many_states = expander.too_many_states();
  if (result.too_many()) result.terms.clear();
  if (result.terms.empty() && !result.too_many()) FindBroken(condition, specialiser, result);
  return result;
}

std::string TooManyText(const Terms& terms) {
  return terms.too_many_states
             ? fmt::format("more than {} settings of state variables", kMaxStateSets)
             : fmt::format("more than {} alternatives of coincident points", kMaxTerms);
}

}  // namespace morphbus::solver
