#include "compiler/solver/motion_inference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace morphbus::solver {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using model::Connector;
using model::Pose;

constexpr double kAngleTolerance = kDirectionTolerance;
/// Sine below which two directions count as parallel, so that they leave a turn free.
constexpr double kCollinear = 1e-4;

/// A literal with its points (or directions) looked up: it holds if some choice of `a` meets some
/// choice of `b`.
struct Constraint {
  const Condition* condition = nullptr;
  int index = 0;  ///< Place in the term.
  bool negated = false;
  bool is_direction = false;
  std::vector<Vector3d> a;
  std::vector<Vector3d> b;  ///< For antiparallel directions: already turned round.

  [[nodiscard]] size_t choices() const { return a.size() * b.size(); }
};

/// True if some point of `a` lies within `tolerance` (m, or length for unit directions) of one of
/// `b`.
bool AnyMeet(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b, double tolerance) {
  return std::any_of(a.begin(), a.end(), [&](const Vector3d& pa) {
    return std::any_of(b.begin(), b.end(),
                       [&](const Vector3d& pb) { return (pa - pb).norm() <= tolerance; });
  });
}

/// One matched pair: a point of each module, or a direction of each.
struct Match {
  bool is_direction = false;
  Vector3d a;
  Vector3d b;
};

class Inference {
 public:
  Inference(double tolerance, double& budget, InferredMotions& result, InferenceTrace* trace)
      : tolerance_(tolerance), budget_(budget), result_(result), trace_(trace) {}

  /// Sorts the literals of a term; false if one about a single module is broken already.
  bool Prepare(const Term& term, const Connector& a, const Connector& b) {
    for (size_t i = 0; i < term.geometry.size(); ++i) {
      const Literal& literal = term.geometry[i];
      const Condition& condition = *literal.condition;
      const PointRef& p = condition.p;
      const PointRef& q = condition.q;
      // The points that the literal names are looked up once.
      Constraint c;
      c.condition = &condition;
      c.index = static_cast<int>(i);
      c.negated = literal.negated;
      c.is_direction = condition.kind != Condition::Kind::kCoincident;
      c.a = FindPoints(p, c.is_direction, p.side == Side::kA ? a : b);
      c.b = FindPoints(q, c.is_direction, q.side == Side::kA ? a : b);
      // Antiparallel is parallel to the direction turned round, so that one comparison serves both.
      if (condition.kind == Condition::Kind::kAntiparallel) {
        for (Vector3d& direction : c.b) direction = -direction;
      }
      // A literal about one module says nothing of the motion: it holds or not, once for all.
      if (p.side == q.side) {
        if (AnyMeet(c.a, c.b, c.is_direction ? kAngleTolerance : tolerance_) == c.negated) {
          Blame(c);
          return false;
        }
        continue;
      }
      // From here on `a` is member a's side, whichever stands first in the source.
      if (p.side == Side::kB) std::swap(c.a, c.b);
      choices_ += static_cast<double>(c.choices());
      (c.negated ? forbidden_ : required_).push_back(std::move(c));
    }
    // Few choices first: a wrong hypothesis is then found early, which keeps the search small.
    std::stable_sort(
        required_.begin(), required_.end(),
        [](const Constraint& l, const Constraint& r) { return l.choices() < r.choices(); });
    return true;
  }

  /// Takes up correspondences from `required_[next]` on, given those in `matches_`.
  void Search(size_t next) {
    if (result_.gave_up) return;
    if (Fixed()) {
      TryMotion();
      return;
    }
    if (next == required_.size()) {
      ReportFree();
      return;
    }
    // Every pair of a point of a with a point of b that this condition allows is a hypothesis. It
    // is followed only if it fits what is matched already.
    const Constraint& c = required_[next];
    if (!Spend(static_cast<double>(c.choices()))) return;
    bool fits_without_gain = false;
    bool fits = false;
    for (const Vector3d& pa : c.a) {
      for (const Vector3d& pb : c.b) {
        const Match match{c.is_direction, pa, pb};
        if (!Consistent(match)) continue;
        fits = true;
        // A pair that adds no new direction leaves the motion as free as before. All such pairs
        // lead to the same search, which is done once, below.
        if (!Gains(match)) {
          fits_without_gain = true;
          continue;
        }
        matches_.push_back(match);
        Search(next + 1);
        matches_.pop_back();
      }
    }
    if (!fits) {
      Blame(c);
      TraceDeadEnd(c);
    }
    if (fits_without_gain) Search(next + 1);
  }

 private:
  /// Pays for `comparisons`; false, and the search ends, when the budget is used up.
  bool Spend(double comparisons) {
    budget_ -= comparisons;
    result_.gave_up = result_.gave_up || budget_ < 0.0;
    return !result_.gave_up;
  }

  /// Remembers the condition that stands last in the source among those that stopped a hypothesis:
  /// it is the one that the nearest attempt failed at.
  void Blame(const Constraint& c) {
    if (c.index >= result_.broken_index) {
      result_.broken_index = c.index;
      result_.broken = c.condition;
    }
  }

  [[nodiscard]] const Match* FirstPoint() const {
    const auto first = std::find_if(matches_.begin(), matches_.end(),
                                    [](const Match& match) { return !match.is_direction; });
    return first == matches_.end() ? nullptr : &*first;
  }

  /// Directions that the matches fix in the two modules: from the first point to the others, and
  /// matched directions.
  [[nodiscard]] std::vector<Match> Directions() const {
    std::vector<Match> result;
    const Match* origin = FirstPoint();
    for (const Match& match : matches_) {
      if (match.is_direction) {
        result.push_back(match);
      } else if (&match != origin) {
        result.push_back({true, match.a - origin->a, match.b - origin->b});
      }
    }
    return result;
  }

  /// Necessary for any rigid motion: equal lengths, and equal projections on what is matched
  /// already.
  [[nodiscard]] bool Consistent(const Match& match) const {
    const Match* origin = FirstPoint();
    if (!match.is_direction && origin == nullptr) return true;
    // A point counts by its arm from the first matched point, so that only directions are compared.
    const Vector3d a = match.is_direction ? match.a : Vector3d(match.a - origin->a);
    const Vector3d b = match.is_direction ? match.b : Vector3d(match.b - origin->b);
    const double slack = match.is_direction ? kAngleTolerance : tolerance_;
    if (std::abs(a.norm() - b.norm()) > 4.0 * slack) return false;
    // A rigid motion keeps angles, so the projections on the known directions must agree as well.
    // The slack grows with both lengths, as the error of a product does.
    for (const Match& known : Directions()) {
      const double allowed = slack * known.a.norm() + tolerance_ * a.norm() +
                             kAngleTolerance * a.norm() * known.a.norm();
      if (std::abs(a.dot(known.a) - b.dot(known.b)) > 4.0 * allowed) return false;
    }
    return true;
  }

  /// True if the match fixes more of the motion: a first point, or a direction not parallel to
  /// those that are known.
  [[nodiscard]] bool Gains(const Match& match) const {
    if (!match.is_direction && FirstPoint() == nullptr) return true;
    const Vector3d along = match.is_direction ? match.a : Vector3d(match.a - FirstPoint()->a);
    const std::vector<Match> directions = Directions();
    return along.norm() > tolerance_ &&
           std::none_of(directions.begin(), directions.end(), [&](const Match& known) {
             return along.cross(known.a).norm() <= kCollinear * along.norm() * known.a.norm();
           });
  }

  /// A point and two directions that are not parallel (each gain is one more of them).
  [[nodiscard]] bool Fixed() const { return matches_.size() >= 3 && FirstPoint() != nullptr; }

  /// The right-handed frame with x along `first` and y in the plane of both directions.
  static Matrix3d Frame(const Vector3d& first, const Vector3d& second) {
    Matrix3d R;
    R.col(0) = first.normalized();
    R.col(2) = first.cross(second).normalized();
    R.col(1) = R.col(2).cross(R.col(0));
    return R;
  }

  void TryMotion() {
    if (!Spend(choices_)) return;
    // Two directions give the rotation, the first point the translation.
    const std::vector<Match> known = Directions();
    const Match* origin = FirstPoint();
    Matrix3d R = Frame(known[0].a, known[1].a) * Frame(known[0].b, known[1].b).transpose();
    // Lattice robots have quarter turns: give them exactly, so that poses do not drift by rounding.
    constexpr double kRounding = 1e-14;
    for (double& entry : R.reshaped()) {
      if (std::abs(entry - std::round(entry)) <= kRounding) entry = std::round(entry) + 0.0;
    }
    Pose X_AB = Pose::Identity();
    X_AB.linear() = R;
    X_AB.translation() = origin->a - R * origin->b;
    // What fixed the motion is only a part of the term; the rest must hold as well, and a motion
    // that others led to counts once.
    TraceMotion(X_AB);
    if (Satisfies(X_AB) && !Holds(result_.motions, X_AB)) result_.motions.push_back(X_AB);
  }

  /// Is the motion one of the list?
  [[nodiscard]] bool Holds(const std::vector<Pose>& motions, const Pose& X_AB) const {
    return std::any_of(motions.begin(), motions.end(),
                       [&](const Pose& other) { return SameMotion(other, X_AB, tolerance_); });
  }

  /// True if some choice of points of `c` coincides under the motion.
  [[nodiscard]] bool Meets(const Constraint& c, const Pose& X_AB) const {
    std::vector<Vector3d> images = c.b;
    for (Vector3d& p : images) p = c.is_direction ? Vector3d(X_AB.linear() * p) : X_AB * p;
    return AnyMeet(c.a, images, c.is_direction ? kAngleTolerance : tolerance_);
  }

  /// Whether all required literals hold and no forbidden one does; if not, the first in the source
  /// that is broken is blamed.
  bool Satisfies(const Pose& X_AB) {
    const Constraint* first_broken = nullptr;
    for (const std::vector<Constraint>* list : {&required_, &forbidden_}) {
      for (const Constraint& c : *list) {
        if (Meets(c, X_AB) != c.negated) continue;
        if (first_broken == nullptr || c.index < first_broken->index) first_broken = &c;
      }
    }
    if (first_broken != nullptr) Blame(*first_broken);
    return first_broken == nullptr;
  }

  /// Keeps a motion that was tried for explanations, each once.
  void TraceMotion(const Pose& X_AB) {
    if (trace_ == nullptr || Holds(trace_->tried, X_AB)) return;
    if (trace_->tried.size() == InferenceTrace::kMaxTried) {
      trace_->overflowed = true;
    } else {
      trace_->tried.push_back(X_AB);
    }
  }

  /// Remembers the dead end that is furthest along: what the point of a measures, and what those of
  /// b do.
  void TraceDeadEnd(const Constraint& c) {
    if (trace_ == nullptr || static_cast<int>(matches_.size()) <= trace_->dead_end_depth) return;
    trace_->dead_end = c.condition;
    trace_->dead_end_depth = static_cast<int>(matches_.size());
    const Match* origin = FirstPoint();
    // Without a point that is matched there are no lengths to be told.
    if (c.is_direction || origin == nullptr) {
      trace_->dead_end_text = "the angle to what is matched already differs between a and b";
      return;
    }
    // The lengths from the first matched point say most: a person can find them in the source.
    const auto lengths = [&](const std::vector<Vector3d>& points, const Vector3d& from) {
      std::vector<std::string> texts;
      for (const Vector3d& p : points) {
        std::string text = fmt::format("{:.6g} m", (p - from).norm());
        if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(text);
      }
      return texts;
    };
    const std::vector<std::string> of_a = lengths(c.a, origin->a);
    const std::vector<std::string> of_b = lengths(c.b, origin->b);
    trace_->dead_end_text =
        fmt::format("no partner fits: from the points that met first, a's is {} away, b's {}",
                    fmt::join(of_a, " or "), fmt::join(of_b, " or "));
    if (of_a == of_b) {
      trace_->dead_end_text += "; the lengths agree, the angles to the other points do not";
    }
  }

  /// Says which motion the matches leave free; the first report stays.
  void ReportFree() {
    if (result_.free_motion) return;
    const Match* origin = FirstPoint();
    const std::vector<Match> known = Directions();
    const auto text = [](const Vector3d& v) {
      // Adding zero turns a negative zero into a plain one.
      return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
    };
    if (origin == nullptr) {
      result_.free_motion = "moving along any direction (no point coincides)";
    } else if (known.empty()) {
      result_.free_motion = fmt::format("turning about every axis through {} m", text(origin->a));
    } else {
      result_.free_motion = fmt::format("turning about the axis through {} m along {}",
                                        text(origin->a), text(known[0].a.normalized()));
    }
  }

  double tolerance_;
  double& budget_;
  InferredMotions& result_;
  InferenceTrace* trace_;  ///< May be null.
  std::vector<Constraint> required_;
  std::vector<Constraint> forbidden_;
  std::vector<Match> matches_;
  double choices_ = 0.0;  ///< Of all constraints together: what checking one motion costs.
};

}  // namespace

bool SameMotion(const model::Pose& X, const model::Pose& Y, double tolerance) {
  return (X.linear() - Y.linear()).cwiseAbs().maxCoeff() <= kAngleTolerance &&
         (X.translation() - Y.translation()).norm() <= 2.0 * tolerance;
}

double MatingTolerance(const model::ModuleType& a, const model::ModuleType& b) {
  constexpr double kRelativeTolerance = 1e-6;  // docs/m3l.md, connections, rules 1 and 2
  return kRelativeTolerance * std::max(model::ExtentOf(a), model::ExtentOf(b));
}

InferredMotions InferMotions(const Term& term, const model::Connector& a, const model::Connector& b,
                             double tolerance, double* budget, InferenceTrace* trace) {
  InferredMotions result;
  Inference inference(tolerance, *budget, result, trace);
  if (inference.Prepare(term, a, b)) inference.Search(0);
  return result;
}

}  // namespace morphbus::solver
