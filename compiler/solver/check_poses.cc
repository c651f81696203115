#include "compiler/solver/check_poses.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <queue>
#include <set>
#include <utility>

#include "compiler/model/kinematic_graph.h"
#include "compiler/model/loop_constraints.h"
#include "compiler/solver/hull_overlap.h"
#include "compiler/solver/motion_inference.h"

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;

/// Loops close to this much (m, rad), as the checker has it.
constexpr double kClosureTolerance = 1e-6;

/// The joints that may be set by themselves: those in no loop, by module and joint.
std::vector<std::vector<bool>> FreeJoints(const model::Model& model, const model::Robot& robot) {
  const std::vector<std::vector<int>> body_of = model::BodiesOf(model, robot);
  std::vector<std::vector<bool>> free;
  std::vector<model::ScrewJoint> edges;
  std::vector<std::pair<int, int>> joint_of_edge;
  int bodies = 0;
  for (int m = 0; m < std::ssize(robot.modules); ++m) {
    const std::vector<model::Joint>& joints = model.TypeOf(robot, m).joints;
    free.emplace_back(joints.size());
    bodies = std::max(bodies, 1 + std::ranges::max(body_of[m]));
    for (int j = 0; j < std::ssize(joints); ++j) {
      if (joints[j].type == model::JointType::kFixed) continue;
      // What is in a loop follows from the bodies alone: axes do not matter.
      model::ScrewJoint& edge = edges.emplace_back();
      edge.body_a = body_of[m][joints[j].link_a];
      edge.body_b = body_of[m][joints[j].link_b];
      joint_of_edge.emplace_back(m, j);
    }
  }
  // A joint that is a part by itself is in no loop, unless both its ends are on one body.
  for (const std::vector<int>& part : model::BiconnectedParts(bodies, edges)) {
    const model::ScrewJoint& edge = edges[part.front()];
    if (part.size() > 1 || edge.body_a == edge.body_b) continue;
    const auto [module, joint] = joint_of_edge[part.front()];
    free[module][joint] = true;
  }
  return free;
}

/// A value away from the start, by `angle` (rad) or, of a slide, by `share` of its range; to the
/// other side where the limits want it, and the start where neither is allowed.
double BentValue(const model::Joint& joint, double start, double angle, double share) {
  double step = angle;
  if (joint.type == model::JointType::kPrismatic) step = share * (joint.upper - joint.lower);
  for (const double value : {start + step, start - step}) {
    if (std::isfinite(value) && value >= joint.lower && value <= joint.upper) return value;
  }
  return start;
}

/// The start values with the free joints bent. Of two joints that follow each other outward and
/// whose axes are parallel one turns this way and the next that way, so that long robots wind
/// along and do not close to a ring.
class Bending {
 public:
  Bending(const model::Model& model, const model::Robot& robot, const model::AssemblyPlan& plan,
          const std::vector<std::vector<bool>>& free)
      : model_(model), robot_(robot), plan_(plan), free_(free) {}

  [[nodiscard]] model::JointValues Values(double angle) const {
    model::JointValues q = model::StartValues(robot_);
    // For each link the turn of the last joint before it, as a vector along its axis in R.
    std::vector<std::vector<Vector3d>> turned(robot_.modules.size());
    for (const model::AddedModule& added : plan_.modules) {
      const model::ModuleType& type = model_.TypeOf(robot_, added.module);
      turned[added.module].assign(type.links.size(), Vector3d::Zero());
      int entry = robot_.root_link;
      if (!added.matings.empty()) {
        const model::Mating& mating = added.matings.front();
        const model::ModuleType& standing = model_.TypeOf(robot_, mating.standing);
        entry = type.connectors[mating.own_connector].link;
        turned[added.module][entry] =
            turned[mating.standing][standing.connectors[mating.standing_connector].link];
      }
      Outward(added.module, entry, angle, q[added.module], turned[added.module]);
    }
    return q;
  }

 private:
  /// Goes from the link `entry` over the joints of a module, which are a tree.
  void Outward(int module, int entry, double angle, std::vector<double>& q,
               std::vector<Vector3d>& turned) const {
    const model::ModuleType& type = model_.TypeOf(robot_, module);
    std::vector<bool> reached(type.links.size());
    reached[entry] = true;
    std::queue<int> todo({entry});
    while (!todo.empty()) {
      const int at = todo.front();
      todo.pop();
      for (size_t j = 0; j < type.joints.size(); ++j) {
        const model::Joint& joint = type.joints[j];
        if (joint.link_a != at && joint.link_b != at) continue;
        const int next = joint.link_a == at ? joint.link_b : joint.link_a;
        if (reached[next]) continue;
        reached[next] = true;
        todo.push(next);
        turned[next] = turned[at];
        if (!free_[module][j]) continue;
        // A positive value turns link a about the axis, and link b the other way.
        const Vector3d axis_R = plan_.X_RL[module][joint.link_a].linear() * joint.axis;
        const Vector3d outer = joint.link_a == next ? axis_R : Vector3d(-axis_R);
        const double side = turned[at].dot(outer) > 0.5 ? -1.0 : 1.0;
        const double start = q[j];
        // 30 degrees are a quarter of a slide's range.
        q[j] = BentValue(joint, start, side * angle, side * angle * 1.5 / std::numbers::pi);
        if (joint.type != model::JointType::kPrismatic && q[j] != start) {
          turned[next] = q[j] > start ? outer : Vector3d(-outer);
        }
      }
    }
  }

  const model::Model& model_;
  const model::Robot& robot_;
  const model::AssemblyPlan& plan_;
  const std::vector<std::vector<bool>>& free_;
};

/// The hull of each convex part of a module's links, with its link.
using ModuleHulls = std::vector<std::pair<int, model::ConvexHull>>;

/// Whether modules that no docking joins lie in each other. Neighbours may: the corners of many
/// modules meet round their joints (docs/m3l.md, which links collide).
class FarOverlap {
 public:
  FarOverlap(const model::Model& model, const model::Robot& robot) : model_(model), robot_(robot) {
    for (const model::ModuleType& type : model.module_types) {
      ModuleHulls& hulls = hulls_.emplace_back();
      double radius = 0.0;
      for (int l = 0; l < std::ssize(type.links); ++l) {
        for (const auto& part : type.links[l].Parts())
          hulls.emplace_back(l, model::ComputeHull(part));
        for (const Vector3d& p : type.links[l].hull) radius = std::max(radius, p.norm());
      }
      radius_.push_back(radius);
    }
    for (const model::Docking& d : robot.dockings) {
      neighbours_.insert(std::minmax(d.module_a, d.module_b));
    }
  }

  [[nodiscard]] bool Any(const std::vector<std::vector<model::Pose>>& X_RL) const {
    const int modules = static_cast<int>(robot_.modules.size());
    for (int a = 0; a < modules; ++a) {
      for (int b = a + 1; b < modules; ++b) {
        if (!neighbours_.contains({a, b}) && Near(X_RL, a, b) && Overlap(X_RL, a, b)) return true;
      }
    }
    return false;
  }

 private:
  [[nodiscard]] int Type(int module) const { return robot_.modules[module].type; }

  /// Whether some links of the two could touch: their frames are within both radii of each other.
  [[nodiscard]] bool Near(const std::vector<std::vector<model::Pose>>& X_RL, int a, int b) const {
    const double reach = radius_[Type(a)] + radius_[Type(b)];
    for (const model::Pose& X : X_RL[a]) {
      for (const model::Pose& Y : X_RL[b]) {
        if ((X.translation() - Y.translation()).norm() <= reach) return true;
      }
    }
    return false;
  }

  [[nodiscard]] bool Overlap(const std::vector<std::vector<model::Pose>>& X_RL, int a,
                             int b) const {
    const double tolerance =
        MatingTolerance(model_.module_types[Type(a)], model_.module_types[Type(b)]);
    double work = 0.0;
    for (const auto& [link_a, hull_a] : hulls_[Type(a)]) {
      for (const auto& [link_b, hull_b] : hulls_[Type(b)]) {
        if (PenetratesBy(tolerance, hull_a, X_RL[a][link_a], hull_b, X_RL[b][link_b], &work)) {
          return true;
        }
      }
    }
    return false;
  }

  const model::Model& model_;
  const model::Robot& robot_;
  std::vector<ModuleHulls> hulls_;
  std::vector<double> radius_;
  std::set<std::pair<int, int>> neighbours_;
};

/// The middle of a link in its own frame: of its hull, else of its connectors.
Vector3d MiddleOfLink(const model::ModuleType& type, int link) {
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (const Vector3d& p : type.links[link].hull) {
    sum += p;
    ++count;
  }
  for (const model::Connector& c : type.connectors) {
    if (!type.links[link].hull.empty() || c.link != link) continue;
    sum += c.p_MoCo_M;
    ++count;
  }
  return count > 0 ? Vector3d(sum / count) : sum;
}

/// What the other ways of mating do to the robot, in any pose.
class OtherWays {
 public:
  OtherWays(const model::Model& model, const model::Robot& robot, const model::AssemblyPlan& plan)
      : model_(model), robot_(robot), plan_(plan) {
    in_loop_.assign(plan.modules.size(), false);
    std::vector<int> place(robot.modules.size());
    std::vector<int> parent(robot.modules.size(), -1);
    for (int i = 0; i < std::ssize(plan.modules); ++i) {
      place[plan.modules[i].module] = i;
      if (i > 0) parent[plan.modules[i].module] = plan.modules[i].matings.front().standing;
    }
    // Of two modules that follow each other in a loop one was put on the other, but for the last
    // step of it, which is the docking that closes it.
    least_extent_ = ExtentOfModule(plan.modules.front().module);
    for (const model::AddedModule& added : plan.modules) {
      least_extent_ = std::min(least_extent_, ExtentOfModule(added.module));
      for (const model::Mating& mating : added.matings) {
        for (size_t k = 0; k + 1 < mating.loop.size(); ++k) {
          const int one = mating.loop[k], next = mating.loop[k + 1];
          if (parent[one] == next) in_loop_[place[one]] = true;
          if (parent[next] == one) in_loop_[place[next]] = true;
        }
      }
    }
    // Modules that hang from each one, itself included: those put on later, over their parents.
    hanging_.resize(plan.modules.size());
    for (int i = 1; i < std::ssize(plan.modules); ++i) {
      for (int m = plan.modules[i].module; m >= 0; m = parent[m]) {
        hanging_[place[m]].push_back(plan.modules[i].module);
      }
    }
  }

  [[nodiscard]] int InLoops() const {
    int ways = 0;
    for (int i = 0; i < std::ssize(plan_.modules); ++i) {
      for (size_t k = 0; k < plan_.modules[i].matings.size(); ++k) {
        if (k == 0 && !in_loop_[i]) continue;
        ways += static_cast<int>(plan_.modules[i].matings[k].ways.size()) - 1;
      }
    }
    return ways;
  }

  /// Fills in what `pose` shows of them.
  void Look(CheckPose& pose) const {
    pose.least_shift_m = 0.05 * least_extent_;
    for (int i = 1; i < std::ssize(plan_.modules); ++i) {
      if (in_loop_[i]) continue;
      const model::Mating& mating = plan_.modules[i].matings.front();
      for (const int number : mating.ways) {
        if (number == mating.number) continue;
        ++pose.num_other_ways;
        if (!Shows(pose, i, number)) pose.alike.push_back({i, number});
      }
    }
  }

 private:
  [[nodiscard]] double ExtentOfModule(int module) const {
    return model::ExtentOf(model_.TypeOf(robot_, module));
  }

  /// Whether what hangs from the docking lies elsewhere if it is made in the way `number`.
  [[nodiscard]] bool Shows(const CheckPose& pose, int added, int number) const {
    const model::Mating& mating = plan_.modules[added].matings.front();
    const model::Docking& d = robot_.dockings[mating.docking];
    const model::Pose& right = model_.OptionOf(d).X_AB;
    const model::Pose& wrong = model_.connection_types[d.connection_type].options[number - 1].X_AB;
    // The motion that takes all of it from where it is to where it would be.
    const bool added_is_b = d.module_b == plan_.modules[added].module;
    const model::Connector& standing = added_is_b ? model_.EndA(robot_, d) : model_.EndB(robot_, d);
    const model::Pose& X_RS = pose.X_RL[mating.standing][standing.link];
    const model::Pose turn = added_is_b ? wrong * right.inverse() : wrong.inverse() * right;
    const model::Pose X_RR = X_RS * turn * X_RS.inverse();
    for (const int module : hanging_[added]) {
      const model::ModuleType& type = model_.TypeOf(robot_, module);
      for (int l = 0; l < std::ssize(type.links); ++l) {
        const Vector3d p_R = pose.X_RL[module][l] * MiddleOfLink(type, l);
        // Modules of a lattice move by exact parts of their extent: rounding shall not decide.
        if ((X_RR * p_R - p_R).norm() > pose.least_shift_m - 1e-9) return true;
      }
    }
    return false;
  }

  const model::Model& model_;
  const model::Robot& robot_;
  const model::AssemblyPlan& plan_;
  /// Whether the first mating of each added module is part of a loop.
  std::vector<bool> in_loop_;
  std::vector<std::vector<int>> hanging_;
  double least_extent_ = 0.0;
};

/// Why the joints cannot all be at 0: limits, or loops; empty if they can.
std::string WhyNotZero(const model::Model& model, const model::Robot& robot,
                       const model::JointValues& zero, const model::KinematicState& state) {
  for (int m = 0; m < std::ssize(robot.modules); ++m) {
    const model::ModuleType& type = model.TypeOf(robot, m);
    for (size_t j = 0; j < type.joints.size(); ++j) {
      const model::Joint& joint = type.joints[j];
      if (joint.lower > zero[m][j] || joint.upper < zero[m][j]) {
        return "0 is beyond the limits of " + robot.modules[m].name + "." + joint.name;
      }
    }
  }
  if (state.closure_m > kClosureTolerance || state.closure_rad > kClosureTolerance) {
    return "its loops do not close there";
  }
  return "";
}

}  // namespace

CheckPoses FindCheckPoses(const model::Model& model, const model::Robot& robot,
                          const model::AssemblyPlan& plan) {
  const OtherWays ways(model, robot, plan);
  const FarOverlap overlap(model, robot);
  CheckPoses found;
  found.num_ways_in_loops = ways.InLoops();
  const auto add = [&](CheckPose::Kind kind, const model::JointValues& q,
                       model::KinematicState state) {
    CheckPose& pose = found.poses.emplace_back();
    pose.kind = kind;
    pose.q = q;
    pose.X_RL = std::move(state.X_RL);
    ways.Look(pose);
  };
  // The start pose is the one in which the robot was put together.
  const model::JointValues start = model::StartValues(robot);
  const model::KinematicState at_start = model::ForwardKinematics(model, robot, start);
  found.closure_m = at_start.closure_m;
  found.closure_rad = at_start.closure_rad;
  found.num_loops = at_start.num_loops;
  add(CheckPose::Kind::kStart, start, at_start);
  model::JointValues zero = start;
  for (std::vector<double>& values : zero) std::ranges::fill(values, 0.0);
  if (zero != start) {
    model::KinematicState state = model::ForwardKinematics(model, robot, zero);
    std::string why = WhyNotZero(model, robot, zero, state);
    if (why.empty() && overlap.Any(state.X_RL)) why = "modules would lie in each other";
    if (why.empty()) {
      add(CheckPose::Kind::kZero, zero, std::move(state));
    } else {
      found.left_out.push_back("All joints at 0 is no pose of this robot: " + why + ".");
    }
  }
  // The bent one: as far as the robot does not run into itself.
  const std::vector<std::vector<bool>> free = FreeJoints(model, robot);
  for (const double degrees : {30.0, 20.0, 10.0}) {
    const model::JointValues q =
        Bending(model, robot, plan, free).Values(degrees * std::numbers::pi / 180.0);
    if (q == start) break;
    model::KinematicState state = model::ForwardKinematics(model, robot, q);
    if (overlap.Any(state.X_RL)) continue;
    add(CheckPose::Kind::kBent, q, std::move(state));
    return found;
  }
  found.left_out.push_back(
      std::ranges::any_of(free, [](const auto& of) { return std::ranges::count(of, true) > 0; })
          ? "There is no bent pose: modules would lie in each other."
          : "There is no bent pose: no joint moves by itself, outside of loops.");
  return found;
}

}  // namespace morphbus::solver
