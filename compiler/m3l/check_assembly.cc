#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <queue>

#include "compiler/m3l/check_robot.h"
#include "compiler/m3l/evaluate.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/solver/hull_overlap.h"

namespace morphbus::m3l::internal {
namespace {

/// Loops close to this much (m, rad); links of modules may lie in each other to this much of the
/// extent.
constexpr double kClosureTolerance = 1e-6;
constexpr double kOverlapTolerance = 1e-6;
constexpr size_t kMaxNamed = 12;
/// Bounds on what a heap of modules in one place may cost and print.
constexpr int kMaxOverlapWarnings = 20;
constexpr double kMaxOverlapWork = 3e8;  // Pairs of edges that are looked at.

using Graph = std::vector<std::vector<int>>;

/// The modules that each module is joined to.
Graph Neighbours(size_t modules, const std::vector<std::pair<int, int>>& edges) {
  Graph graph(modules);
  for (const auto& [a, b] : edges) {
    graph[a].push_back(b);
    graph[b].push_back(a);
  }
  return graph;
}

/// For each module the one before it on a shortest way from `start`; -1 if there is none.
std::vector<int> BreadthFirst(const Graph& graph, int start) {
  std::vector<int> before(graph.size(), -1);
  // The start stands before itself, so that it is no longer "not reached".
  before[start] = start;
  std::queue<int> todo({start});
  while (!todo.empty()) {
    const int at = todo.front();
    todo.pop();
    for (const int next : graph[at]) {
      if (before[next] >= 0) continue;
      before[next] = at;
      todo.push(next);
    }
  }
  return before;
}

/// "m1, m2 and m3", shortened if there are many.
std::string Listed(const std::vector<std::string>& names) {
  if (names.size() > kMaxNamed) {
    const std::vector<std::string> few(names.begin(), names.begin() + kMaxNamed);
    return fmt::format("{} and {} more", fmt::join(few, ", "), names.size() - kMaxNamed);
  }
  if (names.size() == 1) return names[0];
  const std::vector<std::string> most(names.begin(), names.end() - 1);
  return fmt::format("{} and {}", fmt::join(most, ", "), names.back());
}

// --- Loops ---

/// How far a docking is from closing.
struct Gap {
  double metres = 0.0;
  double radians = 0.0;
  [[nodiscard]] bool open() const {
    return !(metres <= kClosureTolerance && radians <= kClosureTolerance);
  }
};

/// The modules of a robot, each rigid at its start values, placed over the dockings breadth first.
/// Loops then close at dockings, where a person can mend them, and never inside a module.
class ModuleTree {
 public:
  explicit ModuleTree(const RobotScope& scope) : scope_(scope) {
    const std::vector<model::ModuleInstance>& modules = scope.robot.modules;
    // The dockings of each module, so that each is followed once from either end.
    std::vector<std::vector<size_t>> dockings_of(modules.size());
    for (size_t d = 0; d < scope.robot.dockings.size(); ++d) {
      dockings_of[scope.robot.dockings[d].module_a].push_back(d);
      dockings_of[scope.robot.dockings[d].module_b].push_back(d);
    }
    for (size_t m = 0; m < modules.size(); ++m) {
      X_ML_.push_back(model::LinkPoses(scope.TypeOf(static_cast<int>(m)), modules[m].start, 0));
    }
    // The root module stays where it is; every other one is placed by the first docking that
    // reaches it.
    X_WM_.assign(modules.size(), model::Pose::Identity());
    std::vector<bool> placed(modules.size());
    placed[scope.robot.root_module] = true;
    std::queue<int> todo({scope.robot.root_module});
    while (!todo.empty()) {
      const int at = todo.front();
      todo.pop();
      for (const size_t d : dockings_of[at]) {
        const model::Docking& docking = scope.robot.dockings[d];
        const bool from_a = docking.module_a == at;
        const int other = from_a ? docking.module_b : docking.module_a;
        if (placed[other]) continue;
        const model::Pose X_MaMb = Across(docking);
        X_WM_[other] = X_WM_[at] * (from_a ? X_MaMb : X_MaMb.inverse());
        placed[other] = true;
        todo.push(other);
      }
    }
  }

  /// How far b's module is from where the docking wants it, measured at b's connector.
  [[nodiscard]] Gap GapOf(const model::Docking& docking) const {
    const model::Pose wanted = X_WM_[docking.module_a] * Across(docking);
    const model::Pose& found = X_WM_[docking.module_b];
    const model::Connector& b = scope_.context.model.EndB(scope_.robot, docking);
    // The gap is measured at b's connector, where a person sees it, and not at its module's origin.
    const Eigen::Vector3d p_MoCo_M = LinkOf(docking.module_b, b) * b.p_MoCo_M;
    const Eigen::AngleAxisd turn(wanted.rotation().transpose() * found.rotation());
    return {(wanted * p_MoCo_M - found * p_MoCo_M).norm(), std::abs(turn.angle())};
  }

 private:
  [[nodiscard]] const model::Pose& LinkOf(int module, const model::Connector& connector) const {
    return X_ML_[module][connector.link];
  }
  /// b's module in a's, at the start values of both.
  [[nodiscard]] model::Pose Across(const model::Docking& docking) const {
    const model::Model& model = scope_.context.model;
    return LinkOf(docking.module_a, model.EndA(scope_.robot, docking)) *
           model.OptionOf(docking).X_AB *
           LinkOf(docking.module_b, model.EndB(scope_.robot, docking)).inverse();
  }

  const RobotScope& scope_;
  std::vector<std::vector<model::Pose>> X_ML_;  ///< [module][link]; M is its first link's frame.
  std::vector<model::Pose> X_WM_;               ///< [module], in the root module's frame.
};

/// Reports a docking that does not close, with the shortest closed way round it.
void ReportLoop(RobotScope& scope, size_t index, const Gap& gap, const Graph& closed) {
  const model::Docking& docking = scope.robot.dockings[index];
  const std::vector<int> before = BreadthFirst(closed, docking.module_a);
  std::vector<std::string> loop;
  // From b back along the shortest way of dockings that close, up to a.
  for (int at = docking.module_b;; at = before[at]) {
    loop.push_back(scope.NameOf(at));
    if (at == docking.module_a || before[at] < 0) break;
  }
  std::reverse(loop.begin(), loop.end());
  // A long loop is told by its two ends.
  if (loop.size() > kMaxNamed) {
    loop.erase(loop.begin() + kMaxNamed / 2, loop.end() - kMaxNamed / 2);
    loop.insert(loop.begin() + kMaxNamed / 2, "...");
  }
  loop.push_back(loop.front());
  scope.diagnostics
      .Error(scope.docking_spans[index],
             fmt::format("the loop {} does not close: the gap here is {} m and {} degrees",
                         fmt::join(loop, " - "), NumberText(std::round(gap.metres * 1e9) / 1e9),
                         NumberText(std::round(gap.radians / std::numbers::pi * 180e6) / 1e6)))
      .hint = "choose other connections in it, by number or rot=, or other start values";
}

/// Every docking must hold with the modules where the tree puts them. Those that close make the
/// graph in which the open ones are told.
void CheckLoops(RobotScope& scope) {
  const ModuleTree tree(scope);
  // Those that close make up the graph; those that do not are told, each with a way round it.
  std::vector<size_t> open;
  std::vector<Gap> gaps;
  std::vector<std::pair<int, int>> edges;
  for (size_t i = 0; i < scope.robot.dockings.size(); ++i) {
    const model::Docking& docking = scope.robot.dockings[i];
    const Gap gap = tree.GapOf(docking);
    if (gap.open()) {
      open.push_back(i);
      gaps.push_back(gap);
    } else {
      edges.emplace_back(docking.module_a, docking.module_b);
    }
  }
  const Graph closed = Neighbours(scope.robot.modules.size(), edges);
  for (size_t i = 0; i < open.size() && !scope.diagnostics.full(); ++i) {
    ReportLoop(scope, open[i], gaps[i], closed);
  }
}

// --- Overlap ---

/// Finds modules whose links lie in each other, with a grid so that only near ones are compared.
class OverlapChecker {
 public:
  OverlapChecker(RobotScope& scope, const model::KinematicState& state)
      : scope_(scope), state_(state) {}

  void Check() {
    BuildHulls();
    // Modules enter the grid one by one, each compared with those that are in it.
    for (size_t m = 0; m < scope_.robot.modules.size(); ++m) {
      for (const size_t other : Near(m)) {
        if (other < m) Compare(other, m);
        if (warnings_ >= kMaxOverlapWarnings || work_ >= kMaxOverlapWork) return;
      }
      grid_[CellOf(m)].push_back(m);
    }
  }

 private:
  using Cell = std::array<int, 3>;

  /// A convex part of a link of some module type.
  struct LinkPart {
    size_t link = 0;
    model::ConvexHull hull;
  };

  /// Hulls of the types in use, and the ball around all of a module's links at its start values.
  void BuildHulls() {
    parts_.resize(scope_.context.model.module_types.size());
    balls_.resize(scope_.robot.modules.size());
    for (size_t m = 0; m < scope_.robot.modules.size(); ++m) {
      const model::ModuleType& type = scope_.TypeOf(static_cast<int>(m));
      std::vector<LinkPart>& parts = parts_[scope_.robot.modules[m].type];
      // Hulls are made once for each type, in the links' own frames.
      if (parts.empty()) {
        for (size_t l = 0; l < type.links.size(); ++l) {
          for (const auto& points : type.links[l].Parts()) {
            parts.push_back({l, model::ComputeHull(points)});
          }
        }
      }
      // The ball round the box of all corners is a cheap bound for the first test.
      Eigen::AlignedBox3d box;
      for (const LinkPart& part : parts) {
        const model::Pose& X_RL = state_.X_RL[m][part.link];
        for (const Eigen::Vector3d& p_L : part.hull.vertices) box.extend(X_RL * p_L);
      }
      if (box.isEmpty()) continue;
      balls_[m] = {box.center(), 0.5 * box.diagonal().norm()};
      cell_size_ = std::max(cell_size_, 2.0 * balls_[m].radius);
    }
  }

  /// The grid cell that holds the centre of module `m`'s ball. Cells are as large as the largest
  /// ball, so that what touches lies in adjacent ones.
  Cell CellOf(size_t m) const {
    Cell cell{};
    for (int i = 0; i < 3; ++i) {
      const double at = cell_size_ > 0.0 ? balls_[m].centre[i] / cell_size_ : 0.0;
      cell[i] = static_cast<int>(std::clamp(std::floor(at), -1e9, 1e9));
    }
    return cell;
  }

  /// The modules in the cell of `m` and in the 26 around it, in order of their numbers.
  std::vector<size_t> Near(size_t m) const {
    std::vector<size_t> near;
    const Cell cell = CellOf(m);
    for (int i = 0; i < 27; ++i) {
      // Digits of i to the base of 3, less one, are steps of -1, 0 and 1 along the three axes.
      const Cell other = {cell[0] + i / 9 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i % 3 - 1};
      const auto it = grid_.find(other);
      if (it != grid_.end()) near.insert(near.end(), it->second.begin(), it->second.end());
    }
    std::sort(near.begin(), near.end());
    return near;
  }

  struct Overlap {
    double depth_m = 0.0;  ///< 0: none beyond the tolerance.
    size_t link_a = 0;
    size_t link_b = 0;
  };

  /// The deepest overlap of two modules' links. Robots are lattices, so that a few relative poses
  /// of a few shapes come again and again: each is looked at once.
  const Overlap& OverlapOf(size_t a, size_t b) {
    // The key: both shapes, and the relative pose rounded.
    const model::Pose X_AB = state_.X_RL[a][0].inverse() * state_.X_RL[b][0];
    PairKey key{ShapeOf(a), ShapeOf(b)};
    for (int i = 0; i < 12; ++i) {
      const double entry = X_AB.matrix()(i % 3, i / 3);
      key[i + 2] = static_cast<int64_t>(std::round(std::clamp(entry, -1e8, 1e8) / kSamePose));
    }
    const auto [it, fresh] = overlaps_.try_emplace(key);
    if (fresh) it->second = FindOverlap(a, b);
    return it->second;
  }

  /// Number of a module's type and start values: two with the same number are of one shape.
  int64_t ShapeOf(size_t m) {
    const model::ModuleInstance& module = scope_.robot.modules[m];
    return shapes_.try_emplace({module.type, module.start}, static_cast<int64_t>(shapes_.size()))
        .first->second;
  }

  /// Compares all hulls of the two modules; only what is deeper than the tolerance counts.
  Overlap FindOverlap(size_t a, size_t b) {
    const int type_a = scope_.robot.modules[a].type;
    const int type_b = scope_.robot.modules[b].type;
    // Rounding moves what touches into each other: overlap counts beyond a part of the modules'
    // extent.
    double deepest = kOverlapTolerance * std::max(scope_.context.modules[type_a].extent_m,
                                                  scope_.context.modules[type_b].extent_m);
    Overlap overlap;
    for (const LinkPart& i : parts_[type_a]) {
      for (const LinkPart& j : parts_[type_b]) {
        // Comparing two hulls costs about the product of their numbers of edges (hull_overlap.h),
        // and a little for two of few.
        work_ += 10.0 + static_cast<double>(i.hull.edges.size()) *
                            static_cast<double>(j.hull.edges.size());
        const double depth = solver::PenetrationDepth(i.hull, state_.X_RL[a][i.link], j.hull,
                                                      state_.X_RL[b][j.link]);
        if (depth <= deepest) continue;
        deepest = depth;
        overlap = {depth, i.link, j.link};
      }
    }
    return overlap;
  }

  /// Warns if modules `a` and `b` lie in each other; the balls are compared first.
  void Compare(size_t a, size_t b) {
    const double apart = (balls_[a].centre - balls_[b].centre).norm();
    if (apart > balls_[a].radius + balls_[b].radius) return;
    const Overlap& overlap = OverlapOf(a, b);
    if (overlap.depth_m <= 0.0) return;
    const std::string links = fmt::format(
        "{}.{} and {}.{}", scope_.robot.modules[a].name,
        scope_.TypeOf(static_cast<int>(a)).links[overlap.link_a].name, scope_.robot.modules[b].name,
        scope_.TypeOf(static_cast<int>(b)).links[overlap.link_b].name);
    ++warnings_;
    scope_.diagnostics
        .Warning(scope_.module_spans[b],
                 fmt::format("in robot '{}', {} lie {} m inside each other", scope_.robot.name,
                             links, NumberText(std::round(overlap.depth_m * 1e9) / 1e9)))
        .Hint(
            "real modules cannot be built so: choose other connections or start values, or smaller "
            "hulls")
        .Note(scope_.module_spans[a], "the other module");
  }

  /// Relative poses within this much (m, and entries of the rotation) are one.
  static constexpr double kSamePose = 1e-9;
  /// Shapes of a and b, then the relative pose.
  using PairKey = std::array<int64_t, 14>;

  struct Ball {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double radius = 0.0;
  };

  RobotScope& scope_;
  const model::KinematicState& state_;
  std::vector<std::vector<LinkPart>> parts_;  ///< By module type, of types in use.
  std::vector<Ball> balls_;                   ///< [module], in R (m).
  double cell_size_ = 0.0;
  std::map<Cell, std::vector<size_t>> grid_;
  std::map<std::pair<int, std::vector<double>>, int64_t> shapes_;
  std::map<PairKey, Overlap> overlaps_;
  int warnings_ = 0;
  double work_ = 0.0;
};

}  // namespace

void CheckConnected(RobotScope& scope) {
  const size_t count = scope.robot.modules.size();
  const Graph graph = Neighbours(count, scope.edges);
  std::vector<int> before = BreadthFirst(graph, scope.robot.root_module);
  std::vector<bool> seen(count);
  for (size_t m = 0; m < count; ++m) seen[m] = before[m] >= 0;
  for (size_t m = 0; m < count && !scope.diagnostics.full(); ++m) {
    if (seen[m]) continue;
    // One error for a group of modules that hang together.
    std::vector<std::string> group;
    before = BreadthFirst(graph, static_cast<int>(m));
    // Those with lower numbers are in groups that were told before, or hang on the root.
    for (size_t other = m; other < count; ++other) {
      if (before[other] < 0) continue;
      seen[other] = true;
      group.push_back(scope.NameOf(static_cast<int>(other)));
    }
    scope.diagnostics
        .Error(scope.module_spans[m],
               fmt::format("{} {} off nothing: no connection leads to '{}'", Listed(group),
                           group.size() == 1 ? "hangs" : "hang",
                           scope.NameOf(scope.robot.root_module)))
        .Note(scope.module_spans[scope.robot.root_module], "the robot is built from this module");
  }
}

void CheckGeometry(RobotScope& scope) {
  const model::KinematicState state =
      model::ForwardKinematics(scope.context.model, scope.robot, model::StartValues(scope.robot));
  CheckLoops(scope);
  OverlapChecker(scope, state).Check();
}

}  // namespace morphbus::m3l::internal
