#include "compiler/congruence/classes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

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
class Labels {
 public:
  Labels(std::vector<double> values, double tolerance) {
    std::sort(values.begin(), values.end());
    for (size_t i = 0; i < values.size(); ++i) {
      if (i == 0 || values[i] - values[i - 1] > tolerance) starts_.push_back(values[i]);
    }
  }
  [[nodiscard]] uint64_t Of(double value) const {
    return std::upper_bound(starts_.begin(), starts_.end(), value) - starts_.begin();
  }

 private:
  std::vector<double> starts_;  ///< The least number of each label.
};

/// The lengths of a joint that no motion changes and the joint of a congruent assembly shares (m):
/// the distances of its axis to the reference points of body a and body b, and of these two points
/// along it.
std::array<double, 3> FiguresOf(const ScrewGraph& graph, int joint) {
  const ScrewJoint& j = graph.joints[joint];
  const Eigen::Vector3d apart = graph.bodies[j.body_b].p_RoTo - graph.bodies[j.body_a].p_RoTo;
  const double along = apart.dot(j.axis);
  if (j.slide) {  // has no place, and the distance along it depends on the start value
    const double across = (apart - along * j.axis).norm();
    return {across, across, 0.0};
  }
  return {graph.FootFrom(j.body_a, joint).norm(), graph.FootFrom(j.body_b, joint).norm(),
          std::abs(along)};
}

/// Sliding or turning, with limits or without, with both ends in one body or not.
uint64_t KindOf(const ScrewJoint& joint) {
  return (joint.slide ? 4 : 0) + (joint.bounded() ? 2 : 0) + (joint.body_a == joint.body_b ? 1 : 0);
}

/// The number of classes that both assemblies' bodies are in.
size_t CountClasses(const Classes& classes) {
  std::set<uint64_t> all(classes.bodies[0].begin(), classes.bodies[0].end());
  all.insert(classes.bodies[1].begin(), classes.bodies[1].end());
  return all.size();
}

/// So many rounds of refinement at most: bodies are told apart by what is so many joints away.
constexpr int kRounds = 64;

/// The label of a number, the same for numbers that count as equal.
using LabelOf = std::function<uint64_t(double)>;

/// The width of a joint's range in units of a tolerance, that of slides as a number below zero,
/// apart from angles; 0 without limits.
double WidthOf(const ScrewJoint& joint, double slide_tolerance) {
  if (!joint.bounded()) return 0.0;
  return (joint.upper - joint.lower) / (joint.slide ? -slide_tolerance : kLimitTolerance);
}

/// The classes of one assembly's bodies and joints by themselves: joints differ in kind and width
/// of range, bodies in the number of their joints.
void AddPlainClasses(const ScrewGraph& graph, double slide_tolerance, const LabelOf& label_of_width,
                     std::vector<uint64_t>& bodies, std::vector<uint64_t>& joints) {
  for (const ScrewJoint& joint : graph.joints) {
    joints.push_back(Mix(KindOf(joint), label_of_width(WidthOf(joint, slide_tolerance))));
  }
  for (const ScrewBody& body : graph.bodies) bodies.push_back(body.joints.size());
}

/// What a joint is as seen from body a and from body b: a hash of its kind, range and figures.
using EndLabels = std::array<uint64_t, 2>;

/// What each joint of an assembly is by itself, from its class and its lengths.
std::vector<EndLabels> EndsOf(const ScrewGraph& graph, const std::vector<uint64_t>& joints,
                              const LabelOf& label_of_length) {
  std::vector<EndLabels> ends;
  for (size_t j = 0; j < joints.size(); ++j) {
    const auto [foot_a, foot_b, along] = FiguresOf(graph, static_cast<int>(j));
    const uint64_t both = Mix(joints[j], label_of_length(along));
    const uint64_t at_a = label_of_length(foot_a);
    const uint64_t at_b = label_of_length(foot_b);
    ends.push_back({Mix(Mix(both, at_a), at_b), Mix(Mix(both, at_b), at_a)});
  }
  return ends;
}

/// One round of colour refinement: a body's next class is its own with the set of its joints, each
/// with the class of the body it leads to. A joint's class follows from those of its two ends.
void Refine(const ScrewGraph& graph, const std::vector<EndLabels>& ends,
            std::vector<uint64_t>& bodies, std::vector<uint64_t>& joints) {
  std::vector<uint64_t> next(bodies.size());
  std::vector<uint64_t> seen;
  for (size_t b = 0; b < bodies.size(); ++b) {
    // The joints of a body as an unordered set: what each is like from this end, with the class
    // beyond it. Sorted, their order does not show in the hash.
    seen.clear();
    for (const int j : graph.bodies[b].joints) {
      const ScrewJoint& joint = graph.joints[j];
      const bool at_a = joint.body_a == static_cast<int>(b);
      seen.push_back(Mix(ends[j][at_a ? 0 : 1], bodies[joint.Other(static_cast<int>(b))]));
    }
    std::sort(seen.begin(), seen.end());
    uint64_t hash = bodies[b];
    for (const uint64_t one : seen) hash = Mix(hash, one);
    next[b] = hash;
  }
  // All bodies at once, since a round must not see classes of its own.
  bodies = std::move(next);
  for (size_t j = 0; j < joints.size(); ++j) {
    const ScrewJoint& joint = graph.joints[j];
    // Which end is a and which is b is no property of the joint, so that the two hashes are put in
    // order.
    const uint64_t a = Mix(ends[j][0], bodies[joint.body_a]);
    const uint64_t b = Mix(ends[j][1], bodies[joint.body_b]);
    joints[j] = Mix(std::min(a, b), std::max(a, b));
  }
}

// Where no other assembly is at hand with which numbers could be labelled they are rounded. The
// limits between the steps lie at fractions at which nobody designs: lengths of 10 µm, and their
// halves and quarters, are well within a step.
constexpr double kLengthStep = 1e-5;  // m
constexpr double kWidthSteps = 10.0;  // of the tolerance of angles, so that 1e-3 rad
constexpr double kCosineStep = 1e-5;
/// Of bodies with more joints, whose pairs are too many, only the joints themselves count.
constexpr size_t kMostPaired = 1000;

uint64_t Rounded(double steps) {
  constexpr double kOffset = 0.3183098861837907;
  return static_cast<uint64_t>(static_cast<int64_t>(std::floor(steps + kOffset)));
}

uint64_t LengthLabel(double length) { return Rounded(length / kLengthStep); }

/// How the axes of two joints of one body lie to each other, which no motion changes, whichever way
/// each of them points: their angle, their distance, and on which side one passes the other.
uint64_t PairLabel(const ScrewJoint& a, const ScrewJoint& b) {
  const double cosine = a.axis.dot(b.axis);
  const uint64_t angle = Rounded(std::abs(cosine) / kCosineStep);
  if (a.slide || b.slide) return angle;  // The axis of a slide has no place.
  constexpr double kParallel = 1e-6;
  const Eigen::Vector3d apart = b.p_RoJo - a.p_RoJo;
  const Eigen::Vector3d across = a.axis.cross(b.axis);
  const double volume = across.dot(apart);
  const double distance = across.norm() > kParallel ? std::abs(volume) / across.norm()
                                                    : (apart - a.axis.dot(apart) * a.axis).norm();
  // To turn one of the axes round changes the signs of both factors, and a mirror that of one.
  return Mix(Mix(angle, LengthLabel(distance)), LengthLabel(volume * cosine));
}

/// Adds to what each joint is as seen from a body how it lies to the body's other joints.
void AddNeighbours(const ScrewGraph& graph, std::vector<EndLabels>& ends) {
  const std::vector<EndLabels> alone = ends;
  std::vector<uint64_t> seen;
  for (size_t b = 0; b < graph.bodies.size(); ++b) {
    const std::vector<int>& joints = graph.bodies[b].joints;
    if (joints.size() > kMostPaired) continue;
    const auto end_at = [&](int joint) {
      return graph.joints[joint].body_a == static_cast<int>(b) ? 0 : 1;
    };
    for (const int joint : joints) {
      seen.clear();
      for (const int other : joints) {
        if (other == joint) continue;
        const uint64_t pair = PairLabel(graph.joints[joint], graph.joints[other]);
        seen.push_back(Mix(alone[other][end_at(other)], pair));
      }
      std::sort(seen.begin(), seen.end());
      for (const uint64_t one : seen) {
        uint64_t& end = ends[joint][end_at(joint)];
        end = Mix(end, one);
      }
    }
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
  // Widths of ranges are labelled over both assemblies.
  const double slide_tolerance = SlideTolerance(a, b);
  std::vector<double> widths;
  for (const ScrewGraph* graph : {&a, &b}) {
    for (const ScrewJoint& joint : graph->joints) widths.push_back(WidthOf(joint, slide_tolerance));
  }
  const Labels labels(std::move(widths), 1.0);
  const auto label = [&](double width) { return labels.Of(width); };
  Classes classes;
  for (const int side : {0, 1}) {
    AddPlainClasses(side == 0 ? a : b, slide_tolerance, label, classes.bodies[side],
                    classes.joints[side]);
  }
  return classes;
}

Classes RefinedClasses(const ScrewGraph& a, const ScrewGraph& b) {
  Classes classes = PlainClasses(a, b);

  // Lengths that are equal within the tolerance get one label, over both assemblies.
  const ScrewGraph* graphs[2] = {&a, &b};
  std::vector<double> all_lengths;
  for (const int side : {0, 1}) {
    for (size_t j = 0; j < classes.joints[side].size(); ++j) {
      const std::array<double, 3> figures = FiguresOf(*graphs[side], static_cast<int>(j));
      all_lengths.insert(all_lengths.end(), figures.begin(), figures.end());
    }
  }
  const Labels lengths(std::move(all_lengths), LengthTolerance(a, b));

  // What each joint is by itself does not change in what follows.
  const auto label = [&](double length) { return lengths.Of(length); };
  const std::vector<EndLabels> ends[2] = {EndsOf(a, classes.joints[0], label),
                                          EndsOf(b, classes.joints[1], label)};

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

uint64_t HashOfClasses(const ScrewGraph& graph) {
  const auto label_of_width = [](double width) {
    return Rounded(width < 0 ? width : width / kWidthSteps);
  };
  std::vector<uint64_t> bodies;
  std::vector<uint64_t> joints;
  AddPlainClasses(graph, kLengthStep, label_of_width, bodies, joints);
  std::vector<EndLabels> ends = EndsOf(graph, joints, LengthLabel);
  AddNeighbours(graph, ends);

  // As in RefinedClasses; congruent assemblies need the same number of rounds.
  size_t count = 0;
  for (int round = 0; round < kRounds; ++round) {
    Refine(graph, ends, bodies, joints);
    const size_t finer = std::set<uint64_t>(bodies.begin(), bodies.end()).size();
    if (finer == count) break;
    count = finer;
  }

  // The order of bodies and joints is that of the modules' names, which do not count.
  uint64_t hash = bodies.size();
  for (std::vector<uint64_t>* classes : {&bodies, &joints}) {
    std::sort(classes->begin(), classes->end());
    for (const uint64_t one : *classes) hash = Mix(hash, one);
  }
  return hash;
}

}  // namespace morphbus::congruence
