#pragma once
// Which conditions a pair of connectors breaks, and what it has instead: the one walk over broken
// conditions that errors and `connections --why` both tell of.

#include <string>
#include <vector>

#include "compiler/solver/connection_problem.h"

namespace morphbus::solver {

/// A condition that does not hold, and what was measured: "c1._2 is 0.01 m from every sub-point".
struct Failure {
  source::Span span;
  std::string measured;
  const Condition* condition = nullptr;  ///< Null where it is the whole.
};

/// What connectors `a` and `b` break of `condition`: with b's module frame at `X_AB` in a's, or,
/// if that is null, in any pose: geometry is then taken to hold unless a point that it names is
/// missing. Of alternatives the first failure of each is told, if all fail. Points coincide to
/// `tolerance` (m).
std::vector<Failure> FindFailures(const Condition& condition, const model::Connector& a,
                                  const model::Connector& b, double tolerance,
                                  const model::Pose* X_AB);

/// The same for `broken`, which no pose satisfies, as one reason for people: "c1 and c2 are both
/// male", or else all that was measured. Names no side that the condition does not.
std::string ExplainBrokenAttributes(const Condition& broken, const model::Connector& a,
                                    const model::Connector& b);

}  // namespace morphbus::solver
