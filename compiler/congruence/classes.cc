#include "compiler/congruence/classes.h"

#include <algorithm>
#include <cmath>

namespace morphbus::congruence {
namespace {

/// Mixes a value into a hash (the finalizer of MurmurHash3).
uint64_t Mix(uint64_t hash, uint64_t value) {
  uint64_t x = hash * 0x9e3779b97f4a7c15u + value;
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdu;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53u;
  return x ^ (x >> 33);
}

/// Gives numbers that lie within a tolerance of each other one label, which rounding them would
/// not: two that are near may lie on either side of a rounding limit. A row of numbers each near
/// the next gets one label as a whole, which makes coarser classes and never wrong ones.
///
/// First Add all numbers, then Close, then ask.
class Labels {
 public:
  explicit Labels(double tolerance) : tolerance_(tolerance) {}

  void Add(double value) { values_.push_back(value); }
  void Close() {
    std::sort(values_.begin(), values_.end());
    for (size_t i = 0; i < values_.size(); ++i) {
      if (i == 0 || values_[i] - values_[i - 1] > tolerance_) starts_.push_back(values_[i]);
    }
  }
  [[nodiscard]] uint64_t Of(double value) const {
    return std::upper_bound(starts_.begin(), starts_.end(), value) - starts_.begin();
  }

 private:
  double tolerance_;
  std::vector<double> values_;  ///< All numbers; sorted once closed.
  std::vector<double> starts_;  ///< The least number of each label.
};

/// The lengths of a joint that no motion changes and the joint of a congruent assembly shares (m).
struct JointFigures {
  double foot[2] = {0, 0};  ///< Distance of the axis to the reference point of body a, body b.
  double along = 0.0;       ///< Distance of these two points along the axis.
};

JointFigures FiguresOf(const ScrewGraph& graph, int joint) {
  const ScrewJoint& j = graph.joints[joint];
  JointFigures figures;
  const Eigen::Vector3d apart = graph.bodies[j.body_b].p_RoTo - graph.bodies[j.body_a].p_RoTo;
  if (j.slide) {  // has no place, and the distance along it depends on the start value
    figures.foot[0] = figures.foot[1] = (apart - apart.dot(j.axis) * j.axis).norm();
    return figures;
  }
  figures.foot[0] = graph.FootFrom(j.body_a, joint).norm();
  figures.foot[1] = graph.FootFrom(j.body_b, joint).norm();
  figures.along = std::abs(apart.dot(j.axis));
  return figures;
}

/// The width of a joint's range (rad, m); -1 if it has no limits.
double WidthOf(const ScrewJoint& j) { return j.bounded() ? j.upper - j.lower : -1.0; }

/// Sliding or turning, with limits or without, with both ends in one body or not.
uint64_t KindOf(const ScrewJoint& joint) {
  return (joint.slide ? 4 : 0) + (joint.bounded() ? 2 : 0) + (joint.body_a == joint.body_b ? 1 : 0);
}

/// The number of classes that both assemblies' bodies are in.
size_t CountClasses(const Classes& classes) {
  std::vector<uint64_t> all;
  for (const std::vector<uint64_t>& bodies : classes.bodies) {
    all.insert(all.end(), bodies.begin(), bodies.end());
  }
  std::sort(all.begin(), all.end());
  return static_cast<size_t>(std::unique(all.begin(), all.end()) - all.begin());
}

/// What a joint is as seen from each of its ends: a hash of its kind, range and figures.
struct EndLabels {
  uint64_t own[2];  ///< Seen from body a, body b.
};

/// One round of colour refinement: a body's next class is its own with the set of its joints, each
/// with the class of the body it leads to. A joint's class follows from those of its two ends.
void Refine(const ScrewGraph& graph, const std::vector<EndLabels>& ends,
            std::vector<uint64_t>& bodies, std::vector<uint64_t>& joints) {
  std::vector<uint64_t> next(bodies.size());
  std::vector<uint64_t> seen;
  for (size_t b = 0; b < bodies.size(); ++b) {
    seen.clear();
    for (const int j : graph.bodies[b].joints) {
      const ScrewJoint& joint = graph.joints[j];
      const bool at_a = joint.body_a == static_cast<int>(b);
      seen.push_back(Mix(ends[j].own[at_a ? 0 : 1], bodies[joint.Other(static_cast<int>(b))]));
    }
    std::sort(seen.begin(), seen.end());
    uint64_t hash = bodies[b];
    for (const uint64_t one : seen) hash = Mix(hash, one);
    next[b] = hash;
  }
  bodies = std::move(next);
  for (size_t j = 0; j < joints.size(); ++j) {
    const ScrewJoint& joint = graph.joints[j];
    const uint64_t a = Mix(ends[j].own[0], bodies[joint.body_a]);
    const uint64_t b = Mix(ends[j].own[1], bodies[joint.body_b]);
    joints[j] = Mix(std::min(a, b), std::max(a, b));
  }
}

}  // namespace

double LengthTolerance(const ScrewGraph& a, const ScrewGraph& b) {
  return kGeometryTolerance * std::max(a.extent_m, b.extent_m);
}

double SlideTolerance(const ScrewGraph& a, const ScrewGraph& b) {
  return kLimitTolerance * std::max(a.extent_m, b.extent_m);
}

Classes PlainClasses(const ScrewGraph& a, const ScrewGraph& b) {
  Labels angles(kLimitTolerance);
  Labels lengths(SlideTolerance(a, b));
  const auto labels = [&](const ScrewJoint& joint) -> Labels& {
    return joint.slide ? lengths : angles;
  };
  // Widths of ranges are labelled over both assemblies, angles and lengths apart.
  for (const ScrewGraph* graph : {&a, &b}) {
    for (const ScrewJoint& joint : graph->joints) labels(joint).Add(WidthOf(joint));
  }
  angles.Close();
  lengths.Close();

  // By themselves joints differ in kind and width of range, bodies in the number of their joints.
  Classes classes;
  for (const int side : {0, 1}) {
    const ScrewGraph& graph = side == 0 ? a : b;
    for (const ScrewJoint& joint : graph.joints) {
      classes.joints[side].push_back(Mix(KindOf(joint), labels(joint).Of(WidthOf(joint))));
    }
    for (const ScrewBody& body : graph.bodies) {
      classes.bodies[side].push_back(body.joints.size());
    }
  }
  return classes;
}

Classes RefinedClasses(const ScrewGraph& a, const ScrewGraph& b) {
  constexpr int kRounds = 64;
  Classes classes = PlainClasses(a, b);

  // Lengths that are equal within the tolerance get one label, over both assemblies.
  Labels lengths(LengthTolerance(a, b));
  std::vector<JointFigures> figures[2];
  for (const int side : {0, 1}) {
    const ScrewGraph& graph = side == 0 ? a : b;
    for (size_t j = 0; j < graph.joints.size(); ++j) {
      const JointFigures& f = figures[side].emplace_back(FiguresOf(graph, static_cast<int>(j)));
      for (const double length : {f.foot[0], f.foot[1], f.along}) lengths.Add(length);
    }
  }
  lengths.Close();

  // What each joint is by itself does not change in what follows.
  std::vector<EndLabels> ends[2];
  for (const int side : {0, 1}) {
    for (size_t j = 0; j < figures[side].size(); ++j) {
      const JointFigures& f = figures[side][j];
      const uint64_t both = Mix(classes.joints[side][j], lengths.Of(f.along));
      const uint64_t foot_a = lengths.Of(f.foot[0]);
      const uint64_t foot_b = lengths.Of(f.foot[1]);
      ends[side].push_back({{Mix(Mix(both, foot_a), foot_b), Mix(Mix(both, foot_b), foot_a)}});
    }
  }

  // Rounds only ever split classes, so as many classes as before are the same classes.
  size_t count = 0;
  for (int round = 0; round < kRounds; ++round) {
    Refine(a, ends[0], classes.bodies[0], classes.joints[0]);
    Refine(b, ends[1], classes.bodies[1], classes.joints[1]);
    const size_t finer = CountClasses(classes);
    if (finer == count) break;
    count = finer;
  }
  return classes;
}

}  // namespace morphbus::congruence
