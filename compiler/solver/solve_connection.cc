#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "compiler/model/convex_hull.h"
#include "compiler/solver/condition_terms.h"
#include "compiler/solver/connection_problem.h"
#include "compiler/solver/failures.h"
#include "compiler/solver/hull_overlap.h"
#include "compiler/solver/motion_inference.h"

namespace morphbus::solver {
namespace {

using model::Connector;
using model::ModuleType;
using model::Pose;

/// A convex part of a link, computed once for all candidates.
struct LinkPart {
  int link = 0;
  model::ConvexHull hull;
};

/// The parts of all links that have a shape, in the order of the links.
std::vector<LinkPart> PartsOf(const ModuleType& type) {
  std::vector<LinkPart> parts;
  for (int i = 0; i < std::ssize(type.links); ++i) {
    for (const auto& points : type.links[i].Parts()) {
      parts.push_back({i, model::ComputeHull(points)});
    }
  }
  return parts;
}

bool HasNoHull(const ModuleType& type) {
  return std::all_of(type.links.begin(), type.links.end(),
                     [](const model::Link& link) { return link.hull.empty(); });
}

/// A rigid motion that satisfies the condition, with the settings of states in which it does.
struct Candidate {
  Pose X_AB;
  std::vector<model::StateSetting> settings;
  /// For each sub-point of member a's connector, last first, the sub-point of b's that it meets
  /// (-1: none), largest first: comparing these in descending order is the numbering rule
  /// (docs/m3l.md, connections).
  std::vector<int> partners_from_the_last;
};

/// Sorts one pair's candidates by the numbering rule; by their transforms where it does not decide.
void SortByRule(std::vector<Candidate>& candidates, const Connector& a, const Connector& b,
                double tolerance) {
  for (Candidate& candidate : candidates) {
    // For each sub-point of a, last first, the sub-point of b that meets it there.
    for (auto p = a.subpoints.rbegin(); p != a.subpoints.rend(); ++p) {
      int& partner = candidate.partners_from_the_last.emplace_back(-1);
      for (size_t j = 0; j < b.subpoints.size(); ++j) {
        const double gap = (*p - candidate.X_AB * b.subpoints[j]).norm();
        if (gap <= tolerance) partner = static_cast<int>(j);
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& l, const auto& r) {
    // The rule: the motion whose last sub-point meets the latest one comes first. Where two agree
    // in all partners, entries of the transforms decide, which depend on nothing but the motion.
    if (l.partners_from_the_last != r.partners_from_the_last) {
      return l.partners_from_the_last > r.partners_from_the_last;
    }
    const auto lm = l.X_AB.matrix().reshaped();
    const auto rm = r.X_AB.matrix().reshaped();
    return std::lexicographical_compare(lm.begin(), lm.end(), rm.begin(), rm.end());
  });
}

/// How many nodes a condition has: the work of specialising it to one pair of connectors.
double NodesOf(const Condition& condition) {
  double nodes = 1.0;
  for (const Condition& child : condition.children) nodes += NodesOf(child);
  return nodes;
}

/// Solves one connection, pair of connectors by pair, last pair first: that is the paper's order of
/// numbers (docs/m3l.md, connections).
class ConnectionSolver {
 public:
  ConnectionSolver(const ConnectionProblem& problem, const std::vector<ModuleType>& types,
                   source::Diagnostics* diagnostics)
      : problem_(problem),
        type_a_(types[problem.type_a]),
        type_b_(types[problem.type_b]),
        diagnostics_(*diagnostics),
        parts_a_(PartsOf(type_a_)),
        parts_b_(PartsOf(type_b_)) {
    tolerance_ = MatingTolerance(type_a_, type_b_);
  }

  /// `broken`: where not null, gets the condition behind each rejection.
  model::ConnectionType Solve(std::vector<source::Span>* broken) {
    result_.name = problem_.name;
    result_.type_a = problem_.type_a;
    result_.type_b = problem_.type_b;
    const int num_a = static_cast<int>(type_a_.connectors.size());
    const int num_b = static_cast<int>(type_b_.connectors.size());
    // A bound on hostile input comes before the first pair is looked at.
    if (1.0 * num_a * num_b * NodesOf(problem_.condition) > kMaxConditionWork) {
      Fail(fmt::format("the condition of connection '{}' is too long for {} pairs of connectors",
                       problem_.name, 1LL * num_a * num_b),
           "");
    }
    for (int a = num_a - 1; a >= 0; --a) {
      for (int b = num_b - 1; b >= 0 && !failed_; --b) SolvePair(a, b);
    }
    // Options are numbered in the order of solving, but rejections are told in the order of
    // declaration.
    std::reverse(result_.rejections.begin(), result_.rejections.end());
    std::reverse(broken_.begin(), broken_.end());
    if (broken != nullptr) *broken = std::move(broken_);
    if (!failed_ && result_.options.empty()) ReportNoneLeft();
    if (!failed_ && (HasNoHull(type_a_) || HasNoHull(type_b_))) WarnAboutHulls();
    if (failed_) result_.options.clear();
    return std::move(result_);
  }

 private:
  // Bounds on hostile input, each a second or two of work and far above any real module.
  static constexpr double kMaxHullWork = 1e8;
  static constexpr double kMaxConditionWork = 1e7;
  static constexpr int kMaxCandidates = 20000;
  static constexpr double kMaxExplanation = 1e6;
  static constexpr size_t kMaxSettings = 100000;

  /// What removed the last candidates: the part that went furthest through the stages.
  struct Obstacle {
    int stage = -1;  ///< 0 attributes, 1 geometry, 2 hulls.
    int index = 0;   ///< Place of the condition within the stage.
    source::Span span;
    std::string what;
    std::pair<int, int> connectors;  ///< The pair that it stopped.
    /// Of attributes: the values of the pairs that came so far, the first few that differ.
    std::vector<std::string> values;
  };

  /// Takes an obstacle over if it is further along than the one that is known.
  void Raise(int stage, int index, const source::Span& span, std::string what,
             std::pair<int, int> connectors) {
    // Of two pairs that came equally far the first one stays.
    if (std::tie(stage, index) <= std::tie(obstacle_.stage, obstacle_.index)) return;
    obstacle_ = {stage, index, span, std::move(what), connectors, {}};
  }

  /// Adds the value for which a pair failed to the obstacle, if the pair came as far as that one: a
  /// value that is misspelt in the condition is seen beside the one that was meant.
  void AddValue(int index, const std::string& value) {
    constexpr size_t kMostValues = 3;
    std::vector<std::string>& values = obstacle_.values;
    // One value is told of "a's c" and, where the other connector is called otherwise, of "c".
    const auto same = [&](const std::string& known) {
      return known.ends_with(value) || value.ends_with(known);
    };
    if (obstacle_.stage == 0 && obstacle_.index == index && values.size() < kMostValues &&
        std::ranges::none_of(values, same)) {
      values.push_back(value);
    }
  }

  /// Specialises, infers, removes what overlaps and numbers what is left, for one pair of
  /// connectors.
  void SolvePair(int index_a, int index_b) {
    const Connector& a = type_a_.connectors[index_a];
    const Connector& b = type_b_.connectors[index_b];
    // First stage: attributes. A pair that they rule out is rejected before any geometry.
    const Terms terms = SpecialiseCondition(problem_.condition, a, b);
    if (terms.too_many()) {
      Fail(fmt::format("connection '{}' leads to {}", problem_.name, TooManyText(terms)),
           terms.too_many_states ? "compare fewer state variables with each other"
                                 : "use fewer 'or' and 'not' over 'coincident' and 'parallel'");
      return;
    }
    if (terms.terms.empty()) {
      std::string why = ExplainBrokenAttributes(*terms.broken, a, b);
      Raise(0, terms.broken_index, terms.broken->span,
            "this condition removed the last pairs of connectors", {index_a, index_b});
      AddValue(terms.broken_index, why);
      Reject(index_a, index_b, std::move(why), terms.broken->span);
      return;
    }
    // Second stage: geometry. The motions of all terms are the candidates.
    source::Span broken = problem_.condition.span;
    std::vector<Candidate> candidates = CandidatesOf(terms, index_a, index_b, broken);
    if (failed_) return;
    if (candidates.empty()) {
      Reject(index_a, index_b,
             fmt::format("no rigid motion brings the points of {} and {} together", a.name, b.name),
             broken);
      return;
    }
    result_.candidates += static_cast<int>(candidates.size());
    if (result_.candidates > kMaxCandidates) {
      Fail(
          fmt::format("connection '{}' has more than {} candidates", problem_.name, kMaxCandidates),
          "tell the connectors apart by attributes");
      return;
    }
    // Third stage: hulls. What is left gets its numbers in the order of the rule.
    KeepThoseApart(candidates, index_a, index_b);
    if (failed_) return;
    SortByRule(candidates, a, b, tolerance_);
    for (Candidate& candidate : candidates) {
      AddOption(index_a, index_b, std::move(candidate));
    }
  }

  /// Numbers what is left of a candidate. The first of its settings is the one that modules dock
  /// in.
  void AddOption(int index_a, int index_b, Candidate candidate) {
    settings_ += candidate.settings.size();
    if (settings_ > kMaxSettings) {
      if (!failed_) {
        Fail(fmt::format("connection '{}' has more than {} settings of state variables in all",
                         problem_.name, kMaxSettings),
             "compare fewer state variables with each other");
      }
      return;
    }
    model::ConnectionOption option;
    // Numbers run on over all pairs, from 1.
    option.number = static_cast<int>(result_.options.size()) + 1;
    option.connector_a = index_a;
    option.connector_b = index_b;
    option.X_AB = candidate.X_AB;
    option.states = std::move(candidate.settings.front());
    option.other_states.assign(std::make_move_iterator(candidate.settings.begin() + 1),
                               std::make_move_iterator(candidate.settings.end()));
    result_.options.push_back(std::move(option));
  }

  /// Records why a pair of connectors has no option, and the condition behind it.
  void Reject(int index_a, int index_b, std::string reason, const source::Span& broken) {
    result_.rejections.push_back({index_a, index_b, std::move(reason)});
    broken_.push_back(broken);
  }

  /// `broken` becomes the condition that stopped the last term without a motion.
  std::vector<Candidate> CandidatesOf(const Terms& terms, int index_a, int index_b,
                                      source::Span& broken) {
    const Connector& a = type_a_.connectors[index_a];
    const Connector& b = type_b_.connectors[index_b];
    std::vector<Candidate> candidates;
    for (const Term& term : terms.terms) {
      const InferredMotions inferred = InferMotions(term, a, b, tolerance_, &comparisons_left_);
      // Both failures concern the conditions and not this pair alone, so they end the whole
      // solving.
      if (inferred.gave_up) {
        Fail(fmt::format("connection '{}' leaves too many ways to match the points of {} and {}",
                         problem_.name, a.name, b.name),
             "name the sub-points that coincide, as in p_a._1 coincident p_b.point");
        return {};
      }
      if (inferred.free_motion) {
        Fail(fmt::format("connection '{}' does not fix {} and {} to each other: {} is left free",
                         problem_.name, a.name, b.name, *inferred.free_motion),
             "add coincident sub-points, or directions that are parallel, until nothing is free");
        return {};
      }
      if (inferred.motions.empty() && inferred.broken != nullptr) {
        broken = inferred.broken->span;
        Raise(1, inferred.broken_index, inferred.broken->span,
              "this condition removed the last candidates" + Measured(term, a, b, *inferred.broken),
              {index_a, index_b});
      }
      for (const Pose& X_AB : inferred.motions) Merge({X_AB, term.settings, {}}, candidates);
    }
    return candidates;
  }

  /// Why `broken` found no partner, as lengths, if that is known.
  std::string Measured(const Term& term, const Connector& a, const Connector& b,
                       const Condition& broken) {
    InferenceTrace trace;
    if (explanation_left_ > 0.0) InferMotions(term, a, b, tolerance_, &explanation_left_, &trace);
    return trace.dead_end == &broken ? ": " + trace.dead_end_text : "";
  }

  /// Adds a motion; where another term gave it already, it is satisfied in the settings of both.
  void Merge(Candidate candidate, std::vector<Candidate>& candidates) const {
    const auto other = std::find_if(candidates.begin(), candidates.end(), [&](const auto& known) {
      return SameMotion(known.X_AB, candidate.X_AB, tolerance_);
    });
    if (other == candidates.end()) {
      candidates.push_back(std::move(candidate));
    } else {
      std::move(candidate.settings.begin(), candidate.settings.end(),
                std::back_inserter(other->settings));
      KeepLeastDemanding(other->settings);
    }
  }

  /// Removes the candidates in which some two hulls lie in each other; if that leaves none, the
  /// pair is rejected with the last overlap.
  void KeepThoseApart(std::vector<Candidate>& candidates, int index_a, int index_b) {
    size_t last_a = 0;
    size_t last_b = 0;
    Pose last_X_AB;
    // The first overlap that is found removes the candidate.
    const auto lies_inside = [&](const Candidate& candidate) {
      for (size_t i = 0; i < parts_a_.size(); ++i) {
        for (size_t j = 0; j < parts_b_.size(); ++j) {
          // The bound is on all pairs together; the failure is reported once, below.
          if (hull_work_ > kMaxHullWork) return false;
          if (!PenetratesBy(tolerance_, parts_a_[i].hull, Pose::Identity(), parts_b_[j].hull,
                            candidate.X_AB, &hull_work_)) {
            continue;
          }
          last_a = i;
          last_b = j;
          last_X_AB = candidate.X_AB;
          return true;
        }
      }
      return false;
    };
    std::erase_if(candidates, lies_inside);
    if (hull_work_ > kMaxHullWork) {
      Fail(fmt::format("the link hulls of connection '{}' are too many or too detailed to compare",
                       problem_.name),
           "give the hulls fewer points");
      return;
    }
    if (!candidates.empty()) return;
    // Only the overlap that is told is measured exactly; the others were stopped at the tolerance.
    const double depth =
        PenetrationDepth(parts_a_[last_a].hull, Pose::Identity(), parts_b_[last_b].hull, last_X_AB);
    const std::string last = fmt::format("{} of a would lie {:.3g} m inside {} of b",
                                         type_a_.links[parts_a_[last_a].link].name, depth,
                                         type_b_.links[parts_b_[last_b].link].name);
    const std::string pair = fmt::format("{} and {}", type_a_.connectors[index_a].name,
                                         type_b_.connectors[index_b].name);
    Reject(index_a, index_b, fmt::format("joining {}, {}", pair, last), problem_.span);
    Raise(2, 0, problem_.span,
          fmt::format("the link hulls removed the last of {} candidates (joining {}, {})",
                      result_.candidates, pair, last),
          {index_a, index_b});
  }

  /// Reports an error of the whole connection, which then has no options.
  void Fail(std::string message, std::string hint) {
    diagnostics_.Error(problem_.span, std::move(message)).hint = std::move(hint);
    failed_ = true;
  }

  /// Reports that no pair of connectors can be joined, and what stopped the pair that came
  /// furthest.
  void ReportNoneLeft() {
    failed_ = true;
    // Without connectors there was no pair to look at.
    if (type_a_.connectors.empty() || type_b_.connectors.empty()) {
      const ModuleType& bare = type_a_.connectors.empty() ? type_a_ : type_b_;
      diagnostics_.Error(
          problem_.span,
          fmt::format("connection '{}' can join nothing: module '{}' has no connector",
                      problem_.name, bare.name));
      return;
    }
    source::Diagnostic& error = diagnostics_.Error(
        problem_.span, fmt::format("connection '{}' leaves no way to join '{}' and '{}'",
                                   problem_.name, type_a_.name, type_b_.name));
    if (obstacle_.stage < 0) return;
    const std::string values =
        obstacle_.values.empty() ? "" : fmt::format(" ({})", fmt::join(obstacle_.values, "; "));
    error.notes.push_back({obstacle_.span, obstacle_.what + values});
    error.hint = WhyHint(type_a_.connectors[obstacle_.connectors.first].name,
                         type_b_.connectors[obstacle_.connectors.second].name);
  }

  /// Warns that nothing could be ruled out by overlap because a member has no hull.
  void WarnAboutHulls() {
    const ModuleType& bare = HasNoHull(type_a_) ? type_a_ : type_b_;
    diagnostics_
        .Warning(problem_.span,
                 fmt::format("module '{}' has no link with a hull, so no way of connection '{}' is "
                             "ruled out by overlap",
                             bare.name, problem_.name))
        .hint =
        "give its links a shape, as in: hull=convex(c1.point, NAME.point); without one, modules "
        "may be mated inside each other";
  }

  const ConnectionProblem& problem_;
  const ModuleType& type_a_;
  const ModuleType& type_b_;
  source::Diagnostics& diagnostics_;
  std::vector<LinkPart> parts_a_;
  std::vector<LinkPart> parts_b_;
  double tolerance_ = 0.0;
  double comparisons_left_ = kMaxInferenceWork;
  double explanation_left_ = kMaxExplanation;
  double hull_work_ = 0.0;
  size_t settings_ = 0;  ///< Those of all options so far.
  model::ConnectionType result_;
  std::vector<source::Span> broken_;  ///< Of each rejection.
  Obstacle obstacle_;
  bool failed_ = false;
};

}  // namespace

std::string WhyHint(const std::string& a, const std::string& b) {
  return fmt::format("see: morphbus connections FILE --why {},{}", a, b);
}

model::ConnectionType SolveConnection(const ConnectionProblem& problem,
                                      const std::vector<ModuleType>& types,
                                      source::Diagnostics* diagnostics,
                                      std::vector<source::Span>* broken) {
  return ConnectionSolver(problem, types, diagnostics).Solve(broken);
}

}  // namespace morphbus::solver
