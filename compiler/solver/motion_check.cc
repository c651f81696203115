#include "compiler/solver/motion_check.h"

#include <algorithm>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "compiler/model/convex_hull.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/kinematic_graph.h"
#include "compiler/model/kinematic_tree.h"
#include "compiler/solver/hull_overlap.h"
#include "compiler/solver/motion_inference.h"
#include "compiler/solver/motion_postures.h"

namespace morphbus::solver {
namespace {

using Eigen::Vector3d;
using model::Docking;
using model::Joint;
using model::JointType;
using model::ModuleType;
using model::Pose;

/// What it costs to hold two balls against each other, and to keep a pair of links, in units of
/// MotionOptions::max_work.
constexpr double kBallWork = 10.0;
constexpr double kPairWork = 1000.0;

/// A convex part of a link with a ball round it, all in the link's frame (m).
struct BalledHull {
  model::ConvexHull hull;
  Vector3d centre = Vector3d::Zero();
  double radius = 0.0;
};

/// Of each link of a module type its parts. To make a hull costs far more than to compare it.
using BalledLinks = std::vector<std::vector<BalledHull>>;

BalledLinks BalledLinksOf(const ModuleType& type) {
  BalledLinks links;
  for (const model::Link& link : type.links) {
    std::vector<BalledHull>& parts = links.emplace_back();
    for (const std::vector<Vector3d>& points : link.Parts()) {
      BalledHull part{model::ComputeHull(points)};
      // The ball is round the middle of the box of all corners.
      Eigen::AlignedBox3d box;
      for (const Vector3d& p_L : part.hull.vertices) box.extend(p_L);
      part.centre = box.center();
      for (const Vector3d& p_L : part.hull.vertices) {
        part.radius = std::max(part.radius, (p_L - part.centre).norm());
      }
      parts.push_back(std::move(part));
    }
  }
  return links;
}

/// For each link of a module type the joints that can move between it and a certain link, which is
/// the root, those next to the root first.
using Paths = std::vector<std::vector<int>>;

Paths PathsFrom(const ModuleType& type, int root) {
  // In breadth from the root: the links of a module are a tree (the compiler of M3L refuses
  // others), so that each is reached on one way.
  Paths paths(type.links.size());
  std::vector<bool> reached(type.links.size());
  reached[root] = true;
  std::queue<int> todo({root});
  while (!todo.empty()) {
    const int at = todo.front();
    todo.pop();
    for (int j = 0; j < std::ssize(type.joints); ++j) {
      const Joint& joint = type.joints[j];
      if (joint.link_a != at && joint.link_b != at) continue;
      const int other = joint.link_a == at ? joint.link_b : joint.link_a;
      if (reached[other]) continue;
      reached[other] = true;
      paths[other] = paths[at];
      if (joint.type != JointType::kFixed) paths[other].push_back(j);
      todo.push(other);
    }
  }
  return paths;
}

/// What is known of two links after some postures. Postures are kept by number, as their values
/// follow from it.
struct Tally {
  int count = 0;
  int first = -1;
  int deepest = -1;
  double first_depth_m = 0.0;
  double depth_m = 0.0;

  /// Adds what `later` postures found.
  void Add(const Tally& later) {
    if (count == 0) {
      first = later.first;
      first_depth_m = later.first_depth_m;
    }
    count += later.count;
    // Of postures with the same depth the first is kept.
    if (later.depth_m <= depth_m) return;
    deepest = later.deepest;
    depth_m = later.depth_m;
  }
};

/// Two links, of module_a and module_b.
using LinkPair = std::pair<int, int>;
/// For each joint of a module its start value if a loop locks it.
using LockedValues = std::vector<std::optional<double>>;
/// By index into DockingKind::pairs.
using Tallies = std::map<int, Tally>;

/// Dockings that differ in the modules' names and the start values of joints that can move alone.
struct DockingKind {
  const ModuleType* type_a = nullptr;
  const ModuleType* type_b = nullptr;
  const BalledLinks* links_a = nullptr;
  const BalledLinks* links_b = nullptr;
  /// The mated links, and the pose of b's in a's.
  int root_a = 0;
  int root_b = 0;
  Pose X_AB = Pose::Identity();
  /// How deep links may lie in each other (m).
  double tolerance = 0.0;
  /// The links that are compared.
  std::vector<LinkPair> pairs;
  /// The joints between each link and the mated one.
  const Paths* paths_a = nullptr;
  const Paths* paths_b = nullptr;
  /// The joints that cannot move.
  LockedValues locked_a;
  LockedValues locked_b;
  /// All joints that can move and matter for some pair, a's first, in declared order.
  std::vector<PairJoint> joints;
  /// What meets in the postures behind the start.
  Tallies tallies;

  [[nodiscard]] const Joint& JointAt(const PairJoint& at) const {
    return (at.of_a ? type_a : type_b)->joints[at.joint];
  }
  [[nodiscard]] const std::optional<double>& LockedAt(const PairJoint& at) const {
    return (at.of_a ? locked_a : locked_b)[at.joint];
  }
};

/// The start values of the joints that matter, of dockings of one kind.
struct StartPosture {
  int kind = 0;
  std::vector<double> values;
  Tallies tallies;
};

/// Two links that lie in each other in the posture that is being tried.
struct Hit {
  Tallies* tallies = nullptr;
  int pair = 0;
  double depth_m = 0.0;
};

/// Checks one robot. Round by round each kind of docking takes one more posture, so that all have
/// the same number of them wherever the work ends.
class MotionChecker {
 public:
  MotionChecker(const model::Model& model, const model::Robot& robot, const MotionOptions& options)
      : model_(model), robot_(robot), options_(options) {}

  MotionReport Check() {
    FindLocked();
    FindKinds();
    while (report_.postures < options_.postures && TryRound(report_.postures)) ++report_.postures;
    Gather();
    report_.num_kinds = static_cast<int>(kinds_.size());
    report_.work = work_;
    return std::move(report_);
  }

 private:
  /// What makes a kind: the connection type, its option, the links that are not compared although
  /// joints lie between them, because other dockings hold them together, and the locked joints.
  using KindKey = std::tuple<int, int, std::vector<LinkPair>, LockedValues, LockedValues>;

  /// Finds out which joints cannot move. Only loops lock joints, so the costly graph is built only
  /// where there are some.
  void FindLocked() {
    for (const model::ModuleInstance& module : robot_.modules) {
      locked_.emplace_back(module.start.size());
    }
    report_.num_loops = static_cast<int>(model::KinematicTree(model_, robot_).loops().size());
    if (report_.num_loops == 0) return;
    for (const model::GraphJoint& at : model::BuildKinematicGraph(model_, robot_).joints) {
      if (!at.locked) continue;
      locked_[at.module][at.joint] = robot_.modules[at.module].start[at.joint];
      ++report_.num_locked;
    }
  }

  /// Finds the kind and the start posture of each docking.
  void FindKinds() {
    body_of_ = model::BodiesOf(model_, robot_);
    for (const Docking& docking : robot_.dockings) {
      if (work_ > options_.max_work) return;
      const int kind = KindOf(docking);
      report_.num_link_pairs += std::ssize(kinds_[kind].pairs);
      // Dockings of one kind with the same start values are one start posture.
      std::vector<double> values;
      for (const PairJoint& at : kinds_[kind].joints) {
        const int module = at.of_a ? docking.module_a : docking.module_b;
        values.push_back(robot_.modules[module].start[at.joint]);
      }
      const auto [it, fresh] =
          start_numbers_.try_emplace({kind, values}, static_cast<int>(starts_.size()));
      if (fresh) {
        // The report may have each pair of links anew for every start posture.
        work_ += kPairWork * static_cast<double>(kinds_[kind].pairs.size());
        starts_.push_back({kind, std::move(values), {}});
      }
      start_of_.push_back(it->second);
    }
  }

  /// The number of the kind of a docking, which is made if it is the first one.
  int KindOf(const Docking& docking) {
    DockingKind kind;
    std::vector<LinkPair> held = FindPairs(docking, &kind);
    const auto [it, fresh] = kind_numbers_.try_emplace(
        {docking.connection_type, docking.option, std::move(held), kind.locked_a, kind.locked_b},
        static_cast<int>(kinds_.size()));
    if (!fresh) return it->second;
    // What does not tell kinds apart is filled in once for each kind.
    kind.links_a = &LinksOf(robot_.modules[docking.module_a].type);
    kind.links_b = &LinksOf(robot_.modules[docking.module_b].type);
    kind.X_AB = model_.OptionOf(docking).X_AB;
    kind.tolerance = MatingTolerance(*kind.type_a, *kind.type_b);
    FindJoints(&kind);
    kinds_.push_back(std::move(kind));
    return it->second;
  }

  /// Fills in what is compared across a docking. Returns the pairs that are not because other
  /// dockings hold them together.
  std::vector<LinkPair> FindPairs(const Docking& docking, DockingKind* kind) {
    const int a = docking.module_a;
    const int b = docking.module_b;
    kind->type_a = &model_.TypeOf(robot_, a);
    kind->type_b = &model_.TypeOf(robot_, b);
    kind->root_a = model_.EndA(robot_, docking).link;
    kind->root_b = model_.EndB(robot_, docking).link;
    kind->paths_a = &PathsOf(robot_.modules[a].type, kind->root_a);
    kind->paths_b = &PathsOf(robot_.modules[b].type, kind->root_b);
    kind->locked_a = locked_[a];
    kind->locked_b = locked_[b];
    work_ += static_cast<double>(kind->paths_a->size() * kind->paths_b->size());
    std::vector<LinkPair> held;
    for (int i = 0; i < std::ssize(*kind->paths_a); ++i) {
      for (int j = 0; j < std::ssize(*kind->paths_b); ++j) {
        // Without shapes there is nothing to compare, and without joints that can move nothing
        // moves.
        if (kind->type_a->links[i].hull.empty() || kind->type_b->links[j].hull.empty()) continue;
        if (!Moves((*kind->paths_a)[i], kind->locked_a) &&
            !Moves((*kind->paths_b)[j], kind->locked_b)) {
          continue;
        }
        const bool is_held = body_of_[a][i] == body_of_[b][j];
        (is_held ? held : kind->pairs).emplace_back(i, j);
      }
    }
    return held;
  }

  /// True if some joint of a path can move.
  static bool Moves(const std::vector<int>& path, const LockedValues& locked) {
    return std::any_of(path.begin(), path.end(), [&](int j) { return !locked[j]; });
  }

  /// Fills in the joints that some pair of links depends on.
  static void FindJoints(DockingKind* kind) {
    std::vector<bool> matters_a(kind->type_a->joints.size());
    std::vector<bool> matters_b(kind->type_b->joints.size());
    for (const auto& [link_a, link_b] : kind->pairs) {
      for (const int j : (*kind->paths_a)[link_a]) matters_a[j] = true;
      for (const int j : (*kind->paths_b)[link_b]) matters_b[j] = true;
    }
    for (const bool of_a : {true, false}) {
      const std::vector<bool>& matters = of_a ? matters_a : matters_b;
      for (int j = 0; j < std::ssize(matters); ++j) {
        if (matters[j] && !kind->LockedAt({of_a, j})) kind->joints.push_back({of_a, j});
      }
    }
  }

  /// The joints between a module type's links and link `root`.
  const Paths& PathsOf(int type, int root) {
    const auto [it, fresh] = paths_.try_emplace({type, root});
    if (fresh) it->second = PathsFrom(model_.module_types[type], root);
    return it->second;
  }

  /// The hulls of a module type's links.
  const BalledLinks& LinksOf(int type) {
    const auto [it, fresh] = links_.try_emplace(type);
    if (fresh) it->second = BalledLinksOf(model_.module_types[type]);
    return it->second;
  }

  /// Tries one posture of each kind, or all start postures. Nothing of it counts if the work is
  /// used up before its end: false then.
  bool TryRound(int posture) {
    if (work_ > options_.max_work) return false;
    std::vector<Hit> hits;
    if (posture == kStartPosture) {
      for (StartPosture& start : starts_) {
        if (!TryPosture(kinds_[start.kind], start.values, &start.tallies, &hits)) return false;
      }
    } else {
      for (DockingKind& kind : kinds_) {
        if (!TryPosture(kind, ValuesOf(kind, posture), &kind.tallies, &hits)) return false;
      }
    }
    for (const Hit& hit : hits) {
      (*hit.tallies)[hit.pair].Add({1, posture, posture, hit.depth_m, hit.depth_m});
    }
    return true;
  }

  /// The values of a kind's joints in a posture that is not the start.
  [[nodiscard]] std::vector<double> ValuesOf(const DockingKind& kind, int posture) const {
    std::vector<const Joint*> joints;
    joints.reserve(kind.joints.size());
    for (const PairJoint& at : kind.joints) joints.push_back(&kind.JointAt(at));
    return PostureValues(joints, options_.seed, posture);
  }

  /// Compares all pairs of links of a kind in one posture. False if the work is used up.
  bool TryPosture(const DockingKind& kind, const std::vector<double>& values, Tallies* tallies,
                  std::vector<Hit>* hits) {
    if (kind.pairs.empty()) return work_ <= options_.max_work;
    // Joints that do not matter stay at 0.
    std::vector<double> q_a;
    std::vector<double> q_b;
    for (const std::optional<double>& locked : kind.locked_a) q_a.push_back(locked.value_or(0.0));
    for (const std::optional<double>& locked : kind.locked_b) q_b.push_back(locked.value_or(0.0));
    for (int i = 0; i < std::ssize(kind.joints); ++i) {
      (kind.joints[i].of_a ? q_a : q_b)[kind.joints[i].joint] = values[i];
    }
    // A is the mated link of module_a: everything is placed in its frame.
    const std::vector<Pose> X_AL = model::LinkPoses(*kind.type_a, q_a, kind.root_a);
    std::vector<Pose> X_AK = model::LinkPoses(*kind.type_b, q_b, kind.root_b);
    for (Pose& X : X_AK) X = kind.X_AB * X;
    work_ += static_cast<double>(X_AL.size() * q_a.size() + X_AK.size() * q_b.size());
    // The deepest of their parts is how deep two links lie.
    for (int p = 0; p < std::ssize(kind.pairs); ++p) {
      const auto [i, j] = kind.pairs[p];
      double deepest = 0.0;
      for (const BalledHull& part_a : (*kind.links_a)[i]) {
        for (const BalledHull& part_b : (*kind.links_b)[j]) {
          if (work_ > options_.max_work) return false;
          deepest =
              std::max(deepest, DepthBeyond(kind.tolerance, part_a, X_AL[i], part_b, X_AK[j]));
        }
      }
      if (deepest > 0.0) hits->push_back({tallies, p, deepest});
    }
    return work_ <= options_.max_work;
  }

  /// How deep two parts lie in each other (m), 0 if not by more than `tolerance`.
  double DepthBeyond(double tolerance, const BalledHull& a, const Pose& X_AL, const BalledHull& b,
                     const Pose& X_AK) {
    work_ += kBallWork;
    if ((X_AL * a.centre - X_AK * b.centre).norm() > a.radius + b.radius) return 0.0;
    if (!PenetratesBy(tolerance, a.hull, X_AL, b.hull, X_AK, &work_)) return 0.0;
    // Those that meet are few, and are measured exactly.
    work_ += static_cast<double>(a.hull.edges.size() * b.hull.edges.size());
    return PenetrationDepth(a.hull, X_AL, b.hull, X_AK);
  }

  /// Writes what was found into the report.
  void Gather() {
    // Dockings of one kind are told together, apart from those that meet at start values of their
    // own.
    std::map<std::pair<int, int>, size_t> places;
    for (int d = 0; d < std::ssize(start_of_); ++d) {
      const StartPosture& start = starts_[start_of_[d]];
      const DockingKind& kind = kinds_[start.kind];
      if (start.tallies.empty() && kind.tallies.empty()) continue;
      const int own_start = start.tallies.empty() ? -1 : start_of_[d];
      const auto [it, fresh] = places.try_emplace({start.kind, own_start}, report_.meetings.size());
      if (fresh) report_.meetings.push_back({{}, MeetingsOf(kind, start)});
      report_.meetings[it->second].dockings.push_back(d);
    }
  }

  /// What meets across dockings of a kind that start so.
  [[nodiscard]] std::vector<LinkMeeting> MeetingsOf(const DockingKind& kind,
                                                    const StartPosture& start) const {
    Tallies tallies = start.tallies;
    for (const auto& [pair, later] : kind.tallies) tallies[pair].Add(later);
    std::vector<LinkMeeting> meetings;
    for (const auto& [pair, tally] : tallies) {
      LinkMeeting meeting;
      std::tie(meeting.link_a, meeting.link_b) = kind.pairs[pair];
      // From a's link to the docking, so the way is the other way round in a.
      const std::vector<int>& path_a = (*kind.paths_a)[meeting.link_a];
      for (auto j = path_a.rbegin(); j != path_a.rend(); ++j) meeting.joints.push_back({true, *j});
      for (const int j : (*kind.paths_b)[meeting.link_b]) meeting.joints.push_back({false, j});
      meeting.num_postures = tally.count;
      meeting.first = {tally.first_depth_m, ValuesOfPath(kind, start, tally.first, meeting.joints)};
      meeting.deepest = {tally.depth_m, ValuesOfPath(kind, start, tally.deepest, meeting.joints)};
      meetings.push_back(std::move(meeting));
    }
    return meetings;
  }

  /// The values of some of a kind's joints in a posture.
  [[nodiscard]] std::vector<double> ValuesOfPath(const DockingKind& kind, const StartPosture& start,
                                                 int posture,
                                                 const std::vector<PairJoint>& path) const {
    const std::vector<double> all =
        posture == kStartPosture ? start.values : ValuesOf(kind, posture);
    std::vector<double> values;
    for (const PairJoint& at : path) {
      if (const std::optional<double>& locked = kind.LockedAt(at)) {
        values.push_back(*locked);
        continue;
      }
      const auto it = std::find_if(kind.joints.begin(), kind.joints.end(), [&](const PairJoint& k) {
        return k.of_a == at.of_a && k.joint == at.joint;
      });
      values.push_back(all[it - kind.joints.begin()]);
    }
    return values;
  }

  const model::Model& model_;
  const model::Robot& robot_;
  const MotionOptions& options_;
  std::vector<LockedValues> locked_;       ///< By module.
  std::vector<std::vector<int>> body_of_;  ///< [module][link]: which are rigid with each other.
  std::map<int, BalledLinks> links_;       ///< By module type, of types in use.
  std::map<std::pair<int, int>, Paths> paths_;  ///< By module type and link.
  std::map<KindKey, int> kind_numbers_;
  std::vector<DockingKind> kinds_;
  std::map<std::pair<int, std::vector<double>>, int> start_numbers_;
  std::vector<StartPosture> starts_;
  std::vector<int> start_of_;  ///< [docking]: index into starts_.
  MotionReport report_;
  double work_ = 0.0;
};

}  // namespace

MotionReport CheckMotion(const model::Model& model, const model::Robot& robot,
                         const MotionOptions& options) {
  return MotionChecker(model, robot, options).Check();
}

}  // namespace morphbus::solver
