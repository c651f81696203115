#include "compiler/congruence/plan.h"

#include <algorithm>
#include <map>

#include "compiler/model/loop_constraints.h"

namespace morphbus::congruence {
namespace {

/// What Step::part_end is until the end is known.
constexpr int kOpenEnd = -1;

/// Goes depth first over a graph. A part begins with the first of its joints that is come to, as
/// the body from which that happens is the only one that the part shares with those before it.
class PartPlanner {
 public:
  explicit PartPlanner(const ScrewGraph& graph)
      : graph_(graph),
        part_of_(graph.joints.size()),
        planned_(graph.joints.size(), false),
        reached_(graph.bodies.size(), false) {
    std::vector<model::ScrewJoint> screws;
    for (const ScrewJoint& j : graph.joints) {
      screws.push_back({j.body_a, j.body_b, j.slide, j.axis, j.p_RoJo});
    }
    const std::vector<std::vector<int>> parts =
        model::BiconnectedParts(static_cast<int>(graph.bodies.size()), screws);
    for (size_t p = 0; p < parts.size(); ++p) {
      for (const int joint : parts[p]) part_of_[joint] = static_cast<int>(p);
    }
    begun_.assign(parts.size(), false);
    plan_.closing.resize(graph.joints.size() + 1);
  }

  Plan Make(int seed) {
    plan_.seed = seed;
    Enter(seed, -1);
    // An explicit stack, as a chain may have thousands of bodies.
    while (!open_.empty()) {
      Open& at = open_.back();
      const std::vector<int>& joints = graph_.bodies[at.body].joints;
      // All joints of the body are gone through: what hangs on the joint that led here is complete.
      if (at.next == joints.size()) {
        if (at.step >= 0) Close(at.step);
        open_.pop_back();
        continue;
      }
      const int joint = joints[at.next++];
      if (planned_[joint]) continue;
      const int step = Add(at.body, joint);
      Enter(graph_.joints[joint].Other(at.body), step);
    }
    return std::move(plan_);
  }

 private:
  /// A body whose joints are being gone through.
  struct Open {
    int body;
    int step;  ///< That which led to it; -1 for the seed.
    size_t next = 0;
  };

  /// Adds a step, and returns its number.
  int Add(int body, int joint) {
    const int part = part_of_[joint];
    // The first joint of a part that is come to begins it, and gets its end by Close.
    plan_.steps.push_back({body, joint, begun_[part] ? 0 : kOpenEnd});
    begun_[part] = planned_[joint] = true;
    return static_cast<int>(plan_.steps.size()) - 1;
  }

  /// Joints that lead back close loops. They come first, as they are the first that can fail.
  void Enter(int body, int step) {
    reached_[body] = true;
    open_.push_back({body, step});
    for (const int joint : graph_.bodies[body].joints) {
      const int other = graph_.joints[joint].Other(body);
      if (planned_[joint] || !reached_[other]) continue;
      const int back = Add(body, joint);
      if (other == body) Close(back);
    }
  }

  /// All beyond the joint of `step` is planned. If a part began there, it ends here.
  void Close(int step) {
    int& end = plan_.steps[step].part_end;
    if (end != kOpenEnd) return;
    end = static_cast<int>(plan_.steps.size());
    plan_.closing[end].push_back(step);
  }

  const ScrewGraph& graph_;
  std::vector<int> part_of_;  ///< By joint.
  std::vector<bool> planned_;
  std::vector<bool> reached_;
  std::vector<bool> begun_;  ///< By part.
  std::vector<Open> open_;
  Plan plan_;
};

/// Have all joints of the body one axis, through its reference point? Then they leave its turn
/// about that axis open.
bool IsCoaxial(const ScrewGraph& graph, int body, double length_tolerance) {
  const std::vector<int>& joints = graph.bodies[body].joints;
  return std::all_of(joints.begin(), joints.end(), [&](int joint) {
    const ScrewJoint& j = graph.joints[joint];
    if (j.axis.cross(graph.joints[joints[0]].axis).norm() > kGeometryTolerance) return false;
    // A slide has no place, but must not have the other body beside it.
    const Eigen::Vector3d apart = graph.bodies[j.Other(body)].p_RoTo - graph.bodies[body].p_RoTo;
    const double out =
        j.slide ? (apart - apart.dot(j.axis) * j.axis).norm() : graph.FootFrom(body, joint).norm();
    return out <= length_tolerance;
  });
}

}  // namespace

Plan PlanByParts(const ScrewGraph& graph, int seed) { return PartPlanner(graph).Make(seed); }

Plan PlanAsOne(const ScrewGraph& graph, int seed) {
  Plan plan;
  plan.seed = seed;
  plan.closing.resize(graph.joints.size() + 1);
  std::vector<bool> planned(graph.joints.size(), false);
  std::vector<bool> reached(graph.bodies.size(), false);
  std::vector<int> order = {seed};
  reached[seed] = true;
  // The list is the queue of a walk in breadth: near joints fail first, at places that a person can
  // follow.
  for (size_t i = 0; i < order.size(); ++i) {
    const int body = order[i];
    for (const int joint : graph.bodies[body].joints) {
      if (planned[joint]) continue;
      planned[joint] = true;
      plan.steps.push_back({body, joint});
      const int other = graph.joints[joint].Other(body);
      if (!reached[other]) order.push_back(other);
      reached[other] = true;
    }
  }
  return plan;
}

int SeedBody(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes) {
  // How many bodies each class has in a and in b.
  std::map<uint64_t, std::pair<int, int>> members;
  for (const uint64_t c : classes.bodies[0]) ++members[c].first;
  for (const uint64_t c : classes.bodies[1]) ++members[c].second;

  // The first body of the least score; one that is coaxial scores higher than any that is not.
  int best = -1;
  std::pair<bool, int> least;
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    const int body = static_cast<int>(i);
    const auto& [in_a, in_b] = members[classes.bodies[0][i]];
    const std::pair score(IsCoaxial(a, body, LengthTolerance(a, b)), std::max(in_a, in_b));
    // A class without a body in b offers no place to begin at.
    if (in_b == 0 || (best >= 0 && score >= least)) continue;
    best = body;
    least = score;
  }
  return best;
}

}  // namespace morphbus::congruence
