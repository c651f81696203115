#pragma once
// Links and joints of two runs whose gaits are compared: by role and label, since numbers of
// modules differ. The figures are those of logger/figures.

#include <string>
#include <utility>
#include <vector>

#include "logger/compare/matcher.h"
#include "logger/figures/run_figures.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// One figure of both runs.
struct FigurePair {
  const ModulePair* pair = nullptr;
  std::string label;
  bool prismatic = false;
  double a = 0.0, b = 0.0;
};

/// Pairs of links whose label speaks of a foot; else all labelled pairs; else the modules' root
/// links.
std::vector<std::pair<const ModulePair*, const LinkPair*>> FootPairs(const Matching& matching);

/// The duties of links that answer to each other and of which one touches the ground in its gait;
/// each link once, by its label if it has one.
std::vector<FigurePair> DutyPairs(const Matching& matching, const RunLog& a, const RunLog& b,
                                  const Gait& gait_a, const Gait& gait_b);
/// The ranges of joints that answer to each other.
std::vector<FigurePair> RangePairs(const Matching& matching, const RunLog& a, const RunLog& b,
                                   const Gait& gait_a, const Gait& gait_b);

}  // namespace morphbus::logger
