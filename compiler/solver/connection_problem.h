#pragma once
// What the M3L checker hands to the connection solver: two module types and the checked conditions.

#include <string>
#include <variant>
#include <vector>

#include "compiler/model/robot_model.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::solver {

/// Which member of the connection: the first declared is a.
enum class Side { kA, kB };

/// A point, or a direction, of the connector that is bound on one side.
struct PointRef {
  /// The centre, one sub-point by name, or any of the sub-points. kAxis, which only kParallel and
  /// kAntiparallel take, is a named axis of the module, the same for all of its connectors.
  enum class Kind { kCentre, kSubpoint, kAnySubpoint, kAxis };
  Side side = Side::kA;
  Kind kind = Kind::kCentre;
  /// The connector that the condition names: on every other one there is no such point. Empty: the
  /// point is on whichever connector is bound.
  std::string connector = {};
  /// For kSubpoint the name of the sub-point, e.g. "_1"; for kAxis that of the axis.
  std::string subpoint;
  /// For kAxis: the unit direction in the module frame.
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
};

/// An attribute or state variable of the connector that is bound on one side.
struct AttributeRef {
  Side side = Side::kA;
  /// The name; a connector that has no such attribute breaks the condition.
  std::string name;
  /// The connector that the condition names, as in PointRef.
  std::string connector = {};
};
/// What a comparison compares: a constant or an attribute.
using Operand = std::variant<model::AttributeValue, AttributeRef>;

/// The comparisons of M3L: ==, !=, <, <=, > and >=.
enum class CompareOp { kEq, kNe, kLt, kLe, kGt, kGe };

/// A node of the condition tree. Names and types are checked already, except that a sub-point or an
/// attribute may be missing from some connectors: such a condition does not hold for them.
struct Condition {
  enum class Kind { kAnd, kOr, kNot, kTrue, kCoincident, kParallel, kAntiparallel, kCompare };
  Kind kind = Kind::kTrue;
  /// The parts of kAnd and kOr, of which there are two or more, or the one of kNot.
  std::vector<Condition> children;
  /// The points of kCoincident, or the directions of kParallel and kAntiparallel: those of
  /// Connector::normals, or of axes.
  PointRef p, q;
  /// The comparison of kCompare and its two sides.
  CompareOp op = CompareOp::kEq;
  Operand lhs, rhs;
  /// The place of the condition, for diagnostics and `connections --why`.
  source::Span span;
};

/// One `connection` definition, checked, for the solver.
struct ConnectionProblem {
  /// The name of the connection, for messages.
  std::string name;
  /// Indices of the members' module types; -1 while a member's type is not known.
  int type_a = -1;
  int type_b = -1;
  Condition condition;
  /// The place of the definition's name.
  source::Span span;
};

/// Solves one `connection`: candidates by inference, pruning by hulls, numbering as in the paper
/// (docs/m3l.md, connections). `types` are all module types; those that `problem` names must be
/// sound. Errors (a motion is left free, no option is left, the condition has too many
/// alternatives) and warnings (a member has no hulls) go to `diagnostics`; with an error the result
/// has no options. `broken`, if not null, gets the place of the condition behind each of the
/// result's rejections, in their order.
model::ConnectionType SolveConnection(const ConnectionProblem& problem,
                                      const std::vector<model::ModuleType>& types,
                                      source::Diagnostics* diagnostics,
                                      std::vector<source::Span>* broken = nullptr);

/// The command that explains connector `a` of member a on connector `b` of member b.
std::string WhyHint(const std::string& a, const std::string& b);

}  // namespace morphbus::solver
