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
using model::StateSetting;

/// A condition as alternatives (disjunctive normal form), with fixed attributes worked out.
struct Alternatives {
  /// At most one has no geometry. Their settings may contain each other.
  std::vector<Term> terms;
  /// If there were too many of them, `terms` is empty.
  bool too_many_terms = false;
  bool too_many_states = false;

  [[nodiscard]] bool too_many() const { return too_many_terms || too_many_states; }
  /// Can the condition hold in no pose and state?
  [[nodiscard]] bool never() const { return terms.empty() && !too_many(); }
  /// Does it hold in every pose and state?
  [[nodiscard]] bool always() const {
    return terms.size() == 1 && terms[0].geometry.empty() && terms[0].settings[0].empty();
  }
};

/// A condition that always holds, or never.
Alternatives Constant(bool value) {
  Alternatives constant;
  // What always holds has one term without geometry, in one setting that demands nothing.
  if (value) constant.terms.emplace_back().settings.emplace_back();
  return constant;
}

/// The union of two settings; nothing if they contradict each other.
std::optional<StateSetting> Merge(const StateSetting& left, const StateSetting& right) {
  StateSetting merged = left;
  // A variable that both settings name must have the same value in both.
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

/// `alternatives`, but with nothing and a note if there are too many of them.
Alternatives Limited(Alternatives alternatives) {
  const std::vector<Term>& terms = alternatives.terms;
  alternatives.too_many_terms = alternatives.too_many_terms || terms.size() > kMaxTerms;
  alternatives.too_many_states =
      alternatives.too_many_states || std::any_of(terms.begin(), terms.end(), [](const auto& term) {
        return term.settings.size() > kMaxStateSets;
      });
  if (alternatives.too_many()) alternatives.terms.clear();
  return alternatives;
}

/// `left` or `right`: their terms are put together. Those without geometry become one.
Alternatives Either(Alternatives left, const Alternatives& right) {
  left.too_many_terms = left.too_many_terms || right.too_many_terms;
  left.too_many_states = left.too_many_states || right.too_many_states;
  for (const Term& term : right.terms) {
    const auto free = std::find_if(left.terms.begin(), left.terms.end(),
                                   [](const Term& t) { return t.geometry.empty(); });
    if (term.geometry.empty() && free != left.terms.end()) {
      free->settings.insert(free->settings.end(), term.settings.begin(), term.settings.end());
    } else {
      left.terms.push_back(term);
    }
  }
  return Limited(std::move(left));
}

/// `left` and `right`: each term of the one with each of the other, in each union of a
/// setting of the one with one of the other, as far as these do not contradict each other.
Alternatives Both(const Alternatives& left, const Alternatives& right) {
  Alternatives both{{},
                    left.too_many_terms || right.too_many_terms ||
                        left.terms.size() * right.terms.size() > kMaxTerms,
                    left.too_many_states || right.too_many_states};
  if (both.too_many()) return both;
  for (const Term& l : left.terms) {
    for (const Term& r : right.terms) {
      // All of the geometry must hold, and of the states every combination that names no variable
      // with two values.
      Term term = l;
      term.geometry.insert(term.geometry.end(), r.geometry.begin(), r.geometry.end());
      term.settings.clear();
      for (const StateSetting& setting_l : l.settings) {
        for (const StateSetting& setting_r : r.settings) {
          std::optional<StateSetting> merged = Merge(setting_l, setting_r);
          if (merged) term.settings.push_back(std::move(*merged));
          if (term.settings.size() > kMaxStateSets) return {{}, false, true};
        }
      }
      // A term in which no setting is left can never hold.
      if (!term.settings.empty()) both.terms.push_back(std::move(term));
    }
  }
  return both;
}

/// Compares two values; values of unlike types differ and have no order.
bool Compare(CompareOp op, const AttributeValue& lhs, const AttributeValue& rhs) {
  if (lhs.index() != rhs.index()) return op == CompareOp::kNe;
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

/// The values an operand may take, each with the state that brings it about.
struct Possibility {
  AttributeValue value;
  std::optional<StateRequirement> state;
};

/// Turns a condition into alternatives for one pair of connectors: fixed attributes and missing
/// points become constants, states become settings to choose from, geometry stays.
class Specialiser {
 public:
  Specialiser(const Connector& a, const Connector& b) : a_(a), b_(b) {}

  /// `condition` as alternatives, or its negation: `not` is pushed down to the leaves on the way.
  [[nodiscard]] Alternatives Build(const Condition& condition, bool negate) const {
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
    const bool directions = condition.kind != Condition::Kind::kCoincident;
    for (const PointRef* ref : {&condition.p, &condition.q}) {
      if (FindPoints(*ref, directions, On(ref->side)).empty()) return Constant(negate);
    }
    // What is left is geometry, which the solver has to look at.
    return {{{{{&condition, negate}}, {{}}}}};
  }

 private:
  [[nodiscard]] const Connector& On(Side side) const { return side == Side::kA ? a_ : b_; }

  /// `and` or `or`; negation swaps the two (De Morgan). A part that decides the whole by itself
  /// comes before all limits.
  [[nodiscard]] Alternatives BuildList(const Condition& condition, bool negate) const {
    const bool is_and = (condition.kind == Condition::Kind::kAnd) != negate;
    std::vector<Alternatives> parts;
    for (const Condition& child : condition.children) {
      parts.push_back(Build(child, negate));
      if (is_and ? parts.back().never() : parts.back().always()) return Constant(!is_and);
    }
    Alternatives all = Constant(is_and);
    for (const Alternatives& part : parts) {
      all = is_and ? Both(all, part) : Either(std::move(all), part);
    }
    return all;
  }

  /// The values that an operand can take: one if it is fixed, those of the state variable if it is
  /// free, none if the connector has no such attribute.
  [[nodiscard]] std::vector<Possibility> PossibilitiesOf(const Operand& operand) const {
    if (const auto* value = std::get_if<AttributeValue>(&operand)) return {{*value, {}}};
    const auto& ref = std::get<AttributeRef>(operand);
    const Connector& connector = On(ref.side);
    if (!ref.connector.empty() && ref.connector != connector.name) return {};
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
  [[nodiscard]] Alternatives BuildCompare(const Condition& condition, bool negate) const {
    const std::vector<Possibility> lhs = PossibilitiesOf(condition.lhs);
    const std::vector<Possibility> rhs = PossibilitiesOf(condition.rhs);
    if (lhs.empty() || rhs.empty()) return Constant(negate);
    Term term;
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
        StateSetting setting;
        if (l.state) setting.push_back(*l.state);
        if (r.state && !same) setting.push_back(*r.state);
        term.settings.push_back(std::move(setting));
      }
    }
    // If all or none of the combinations hold, no state is asked for.
    if (term.settings.empty()) return Constant(false);
    if (term.settings.size() == combinations) return Constant(true);
    return Limited({{std::move(term)}});
  }

  const Connector& a_;
  const Connector& b_;
};

/// The first of the parts of a condition, in source order, that must hold and cannot; null if each
/// can. `index` grows by the parts before it.
const Condition* FirstBroken(const Condition& condition, const Specialiser& specialiser,
                             int& index) {
  if (condition.kind != Condition::Kind::kAnd) {
    if (specialiser.Build(condition, false).never()) return &condition;
    ++index;
    return nullptr;
  }
  for (const Condition& child : condition.children) {
    if (const Condition* broken = FirstBroken(child, specialiser, index)) return broken;
  }
  return nullptr;
}

}  // namespace

std::vector<Eigen::Vector3d> FindPoints(const PointRef& ref, bool direction,
                                        const Connector& connector) {
  // An axis is the same for all connectors; a normal belongs to the point that it is given for.
  if (ref.kind == PointRef::Kind::kAxis) return {ref.axis.normalized()};
  if (!ref.connector.empty() && ref.connector != connector.name) return {};
  if (direction && ref.kind == PointRef::Kind::kAnySubpoint) {
    std::vector<Eigen::Vector3d> directions;
    for (const std::string& name : connector.subpoint_names) {
      const auto normal = connector.normals.find(name);
      if (normal != connector.normals.end()) directions.push_back(normal->second);
    }
    return directions;
  }
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
  // Alternatives over geometry become terms of their own, as each is solved for itself. States need
  // no solving: the settings go with their term.
  const Specialiser specialiser(a, b);
  Alternatives alternatives = specialiser.Build(condition, false);
  for (Term& term : alternatives.terms) KeepLeastDemanding(term.settings);
  result.terms = std::move(alternatives.terms);
  result.too_many_terms = alternatives.too_many_terms;
  result.too_many_states = alternatives.too_many_states;
  if (result.terms.empty() && !result.too_many()) {
    // The whole, if only the combination of its parts is impossible.
    result.broken = FirstBroken(condition, specialiser, result.broken_index);
    if (result.broken == nullptr) result.broken = &condition;
  }
  return result;
}

void KeepLeastDemanding(std::vector<StateSetting>& settings) {
  std::stable_sort(settings.begin(), settings.end(),
                   [](const auto& l, const auto& r) { return l.size() < r.size(); });
  std::vector<StateSetting> kept;
  for (StateSetting& setting : settings) {
    // A setting adds nothing if all that one of the kept ones asks for is among what it asks for.
    const bool adds = std::none_of(kept.begin(), kept.end(), [&](const StateSetting& known) {
      return std::all_of(known.begin(), known.end(), [&](const StateRequirement& state) {
        return std::find(setting.begin(), setting.end(), state) != setting.end();
      });
    });
    if (adds) kept.push_back(std::move(setting));
  }
  settings = std::move(kept);
}

std::string TooManyText(const Terms& terms) {
  return terms.too_many_states
             ? fmt::format("more than {} settings of state variables", kMaxStateSets)
             : fmt::format("more than {} alternatives of coincident points", kMaxTerms);
}

}  // namespace morphbus::solver
