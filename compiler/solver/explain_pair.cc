#include "compiler/solver/explain_pair.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/model/convex_hull.h"
#include "compiler/solver/condition_terms.h"
#include "compiler/solver/failures.h"
#include "compiler/solver/hull_overlap.h"
#include "compiler/solver/motion_inference.h"

namespace morphbus::solver {
namespace {

using model::Connector;
using model::ModuleType;
using model::Pose;

/// Pairs of edges that are held against each other before further motions are left out, which
/// bounds the time that hulls with thousands of corners take.
constexpr double kMaxHullWork = 3e7;

/// Of each link of a module type the hulls of its parts, in the module's frame. To make a hull
/// costs more than to hold two against each other, which every candidate does with every pair of
/// links.
using LinkHulls = std::vector<std::vector<model::ConvexHull>>;

LinkHulls HullsOf(const ModuleType& type) {
  LinkHulls hulls;
  for (const auto& link : type.links) {
    hulls.emplace_back();
    for (const auto& part : link.Parts()) hulls.back().push_back(model::ComputeHull(part));
  }
  return hulls;
}

/// How deep two links, in one frame, lie in each other (m): of their parts those that do so most
/// count.
double DepthOf(const std::vector<model::ConvexHull>& link_a,
               const std::vector<model::ConvexHull>& link_b, double* work) {
  double depth = 0.0;
  for (const auto& part_a : link_a) {
    for (const auto& part_b : link_b) {
      *work += static_cast<double>(part_a.edges.size()) * static_cast<double>(part_b.edges.size());
      depth = std::max(depth, PenetrationDepth(part_a, part_b));
    }
  }
  return depth;
}

/// The pairs of link hulls that lie in each other by more than `tolerance` (m), the deepest first.
/// `work` grows by the pairs of edges.
std::vector<Overlap> OverlapsOf(const LinkHulls& links_a, const LinkHulls& links_b,
                                const Pose& X_AB, double tolerance, double* work) {
  std::vector<Overlap> overlaps;
  LinkHulls links_b_in_a = links_b;
  for (auto& parts : links_b_in_a) {
    for (auto& part : parts) part = Moved(part, X_AB);
  }
  for (size_t i = 0; i < links_a.size(); ++i) {
    for (size_t j = 0; j < links_b.size(); ++j) {
      const double depth = DepthOf(links_a[i], links_b_in_a[j], work);
      if (depth > tolerance) overlaps.push_back({static_cast<int>(i), static_cast<int>(j), depth});
    }
  }
  // The deepest overlap says most, and comes first.
  std::stable_sort(overlaps.begin(), overlaps.end(),
                   [](const Overlap& l, const Overlap& r) { return l.depth_m > r.depth_m; });
  return overlaps;
}

}  // namespace

PairExplanation ExplainPair(const ConnectionProblem& problem, const std::vector<ModuleType>& types,
                            int connector_a, int connector_b) {
  const ModuleType& type_a = types[problem.type_a];
  const ModuleType& type_b = types[problem.type_b];
  const Connector& a = type_a.connectors[connector_a];
  const Connector& b = type_b.connectors[connector_b];
  const double tolerance = MatingTolerance(type_a, type_b);
  PairExplanation result;
  // Attributes come first: if they rule the pair out, or leave too much to look at, no motion needs
  // to be looked for.
  const Terms terms = SpecialiseCondition(problem.condition, a, b);
  if (terms.too_many()) {
    result.failures.push_back({problem.condition.span, TooManyText(terms), nullptr});
    return result;
  }
  if (terms.terms.empty()) {
    // Each attribute may be fine on its own and only their combination impossible.
    result.failures = FindFailures(problem.condition, a, b, tolerance, nullptr);
    if (result.failures.empty()) {
      result.failures.push_back({problem.condition.span,
                                 "no setting of the state variables satisfies all of this",
                                 nullptr});
    }
    return result;
  }
  // The inference is run once more, as the solver runs it, but keeps every motion that it tries.
  InferenceTrace trace;
  double budget = kMaxInferenceWork;
  for (const Term& term : terms.terms) {
    const InferredMotions inferred = InferMotions(term, a, b, tolerance, &budget, &trace);
    if (inferred.free_motion) result.free_motion = inferred.free_motion;
  }
  result.complete = !trace.overflowed && budget > 0.0;
  // Each motion is held against the whole condition, not only against the term that led to it.
  // Hulls matter only where all conditions hold, and are made for the first such motion.
  LinkHulls links_a;
  LinkHulls links_b;
  double hull_work = 0.0;
  for (const Pose& X_AB : trace.tried) {
    if (hull_work > kMaxHullWork) {
      result.complete = false;
      break;
    }
    ExplainedCandidate candidate;
    candidate.X_AB = X_AB;
    candidate.failures = FindFailures(problem.condition, a, b, tolerance, &X_AB);
    if (candidate.failures.empty()) {
      if (links_a.empty()) links_a = HullsOf(type_a);
      if (links_b.empty()) links_b = HullsOf(type_b);
      candidate.overlaps = OverlapsOf(links_a, links_b, X_AB, tolerance, &hull_work);
    }
    result.candidates.push_back(std::move(candidate));
  }
  // What was kept is shown first, then what came nearest to it.
  const auto rank = [](const ExplainedCandidate& c) {
    return c.kept() ? 0 : c.failures.empty() ? 1 : 2;
  };
  std::stable_sort(result.candidates.begin(), result.candidates.end(),
                   [&](const auto& l, const auto& r) { return rank(l) < rank(r); });
  // Without any motion the best explanation is the condition for which no partner was found.
  if (result.candidates.empty() && trace.dead_end != nullptr) {
    result.dead_end = Failure{trace.dead_end->span, trace.dead_end_text, trace.dead_end};
  }
  return result;
}

}  // namespace morphbus::solver
