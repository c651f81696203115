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

/// A point of the connector that is bound on one side.
struct PointRef {
  /// kAxis (kParallel, kAntiparallel only): a named axis of the module, the same for all
  /// connectors.
  enum class Kind { kCentre, kSubpoint, kAnySubpoint, kAxis };
  Side side = Side::kA;
  Kind kind = Kind::kCentre;
  std::string subpoint;  ///< For kSubpoint: its name, e.g. "_1". For kAxis: the axis' name.
  Eigen::Vector3d axis =
      Eigen::Vector3d::Zero();  ///< For kAxis: unit direction in the module frame.
};

struct AttributeRef {
  Side side = Side::kA;
  std::string name;
};
using Operand = std::variant<model::AttributeValue, AttributeRef>;

enum class CompareOp { kEq, kNe, kLt, kLe, kGt, kGe };

/// A node of the condition tree. Names and types are checked already, except that a sub-point or an
/// attribute may be missing from some connectors: such a condition does not hold for them.
struct Condition {
  enum class Kind { kAnd, kOr, kNot, kTrue, kCoincident, kParallel, kAntiparallel, kCompare };
  Kind kind = Kind::kTrue;
  std::vector<Condition> children;  ///< kAnd, kOr: two or more; kNot: one.
  PointRef p, q;                    ///< kCoincident; kParallel, kAntiparallel (of
                                    ///< Connector::normals or of axes).
  CompareOp op = CompareOp::kEq;    ///< kCompare.
  Operand lhs, rhs;                 ///< kCompare.
  source::Span span;                ///< For diagnostics and `connections --why`.
};

struct ConnectionProblem {
  std::string name;
  int type_a = 0;  ///< Indices into `types`.
  int type_b = 0;
  Condition condition;
  source::Span span;  ///< Of the definition's name.
};

/// Solves one `connection`: candidates by inference, pruning by hulls, the paper's numbering.
/// Errors (under-determined, none left, too many DNF terms) and warnings (no hulls) go to
/// `diagnostics`. The result has no options when there were errors. `broken`, if not null, gets for
/// each of the result's rejections the place of the condition behind it.
model::ConnectionType SolveConnection(const ConnectionProblem& problem,
                                      const std::vector<model::ModuleType>& types,
                                      source::Diagnostics& diagnostics,
                                      std::vector<source::Span>* broken = nullptr);

/// The command that explains connector `a` of member a on connector `b` of member b.
std::string WhyHint(const std::string& a, const std::string& b);

}  // namespace morphbus::solver
