#include "compiler/model/assembly_plan.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "compiler/base/check.h"

namespace morphbus::model {
namespace {

using Eigen::Vector3d;

/// Directions that differ by less than some 2 degrees are the same way to a person.
constexpr double kSameWay = 0.9994;

/// The direction in which a connector faces in the module frame.
std::optional<Vector3d> FaceOf(const Connector& connector) {
  const auto normal = connector.normals.find("");
  if (normal == connector.normals.end()) return std::nullopt;
  return normal->second;
}

/// Builds the plan of one robot.
class Planner {
 public:
  Planner(const Model& model, const Robot& robot)
      : model_(model), robot_(robot), dockings_of_(robot.modules.size()) {
    for (int d = 0; d < std::ssize(robot.dockings); ++d) {
      dockings_of_[robot.dockings[d].module_a].push_back(d);
      dockings_of_[robot.dockings[d].module_b].push_back(d);
    }
    plan_.X_RL = ForwardKinematics(model, robot, StartValues(robot)).X_RL;
    for (int m = 0; m < std::ssize(robot.modules); ++m) {
      auto& faces = plan_.faces_R.emplace_back();
      for (const Connector& connector : model.TypeOf(robot, m).connectors) {
        faces.push_back(FaceOf(connector));
        if (faces.back()) *faces.back() = plan_.X_RL[m][connector.link].linear() * *faces.back();
      }
    }
  }

  AssemblyPlan Plan() {
    parent_.assign(robot_.modules.size(), -1);
    // At which place of the order each module stands; -1 for those that do not yet.
    std::vector<int> place(robot_.modules.size(), -1);
    for (const int module : Order()) {
      AddedModule added;
      added.module = module;
      for (const int d : dockings_of_[module]) {
        if (place[Other(d, module)] >= 0) added.matings.push_back(MatingOf(d, module));
      }
      // What has stood for longest comes first: it is nearest to the root.
      std::ranges::stable_sort(added.matings, {},
                               [&](const Mating& m) { return place[m.standing]; });
      for (size_t i = 0; i < added.matings.size(); ++i) {
        if (i == 0) {
          parent_[module] = added.matings[0].standing;
        } else {
          added.matings[i].loop = LoopBetween(module, added.matings[i].standing);
        }
      }
      if (!added.matings.empty()) ChooseWay(added);
      place[module] = static_cast<int>(plan_.modules.size());
      plan_.modules.push_back(std::move(added));
    }
    MORPHBUS_CHECK(plan_.modules.size() == robot_.modules.size());
    return std::move(plan_);
  }

 private:
  /// The module at the other end of a docking.
  [[nodiscard]] int Other(int docking, int module) const {
    const Docking& d = robot_.dockings[docking];
    return d.module_a == module ? d.module_b : d.module_a;
  }

  /// Breadth first from the root module, over dockings in declared order.
  [[nodiscard]] std::vector<int> Order() const {
    std::vector<int> order;
    std::vector<bool> reached(robot_.modules.size());
    std::queue<int> todo({robot_.root_module});
    reached[robot_.root_module] = true;
    while (!todo.empty()) {
      const int at = todo.front();
      todo.pop();
      order.push_back(at);
      for (const int d : dockings_of_[at]) {
        const int next = Other(d, at);
        if (reached[next]) continue;
        reached[next] = true;
        todo.push(next);
      }
    }
    return order;
  }

  [[nodiscard]] Mating MatingOf(int docking, int module) const {
    const Docking& d = robot_.dockings[docking];
    const bool own_is_a = d.module_a == module;
    Mating mating;
    mating.docking = docking;
    mating.own_connector = own_is_a ? d.connector_a : d.connector_b;
    mating.standing = own_is_a ? d.module_b : d.module_a;
    mating.standing_connector = own_is_a ? d.connector_b : d.connector_a;
    AddWays(d, mating);
    AddPoints(d, own_is_a, mating);
    AddSameWay(module, mating);
    return mating;
  }

  /// The ways of the pair, and the turn from the first to the robot's.
  void AddWays(const Docking& d, Mating& mating) const {
    const ConnectionOption& chosen = model_.OptionOf(d);
    const ConnectionOption* first = nullptr;
    mating.number = chosen.number;
    for (const ConnectionOption& option : model_.connection_types[d.connection_type].options) {
      if (option.connector_a != d.connector_a || option.connector_b != d.connector_b) continue;
      if (first == nullptr) first = &option;
      mating.ways.push_back(option.number);
    }
    const ModuleType& type_a = model_.TypeOf(robot_, d.module_a);
    const double extent = std::max(ExtentOf(type_a), ExtentOf(model_.TypeOf(robot_, d.module_b)));
    const auto turn = TurnOfOption(type_a, extent, *first, chosen);
    if (!turn) return;
    // Where the way out is not known, the turn has no sign.
    const std::optional<Vector3d> face = FaceOf(type_a.connectors[d.connector_a]);
    const FaceNormal normal = face ? FaceNormal{*face, true} : FaceNormal{turn->axis(), false};
    mating.turn = TurnBetween(type_a, extent, normal, *first, chosen);
  }

  void AddPoints(const Docking& d, bool own_is_a, Mating& mating) const {
    const Pose& X_AB = model_.OptionOf(d).X_AB;
    const std::vector<Vector3d>& of_a = model_.EndA(robot_, d).subpoints;
    const std::vector<Vector3d>& of_b = model_.EndB(robot_, d).subpoints;
    const double tolerance = 2e-6 * std::max(ExtentOf(model_.TypeOf(robot_, d.module_a)),
                                             ExtentOf(model_.TypeOf(robot_, d.module_b)));
    for (int a = 0; a < std::ssize(of_a); ++a) {
      for (int b = 0; b < std::ssize(of_b); ++b) {
        if ((of_a[a] - X_AB * of_b[b]).norm() > tolerance) continue;
        mating.points.push_back(own_is_a ? std::pair(a, b) : std::pair(b, a));
      }
    }
    std::ranges::sort(mating.points);
  }

  void AddSameWay(int module, Mating& mating) const {
    const auto& own = plan_.faces_R[module];
    const auto& standing = plan_.faces_R[mating.standing];
    const std::optional<Vector3d>& line = standing[mating.standing_connector];
    if (!line) return;
    for (int i = 0; i < std::ssize(own); ++i) {
      if (!own[i] || std::abs(own[i]->dot(*line)) > kSameWay) continue;
      for (int j = 0; j < std::ssize(standing); ++j) {
        if (standing[j] && own[i]->dot(*standing[j]) > kSameWay) mating.same_way.emplace_back(i, j);
      }
    }
  }

  /// The modules on the way that was built from one module to another, both included.
  [[nodiscard]] std::vector<int> LoopBetween(int from, int to) const {
    const auto up = [&](int module) {
      std::vector<int> way = {module};
      while (parent_[way.back()] >= 0) way.push_back(parent_[way.back()]);
      return way;
    };
    // Both ways end at the root; what they share but for its first module is left out.
    std::vector<int> one = up(from);
    std::vector<int> other = up(to);
    while (one.size() > 1 && other.size() > 1 && one[one.size() - 2] == other[other.size() - 2]) {
      one.pop_back();
      other.pop_back();
    }
    other.pop_back();
    one.insert(one.end(), other.rbegin(), other.rend());
    return one;
  }

  /// From where the module comes: away from all faces on which it is put, or along them where these
  /// look at each other.
  void ChooseWay(AddedModule& added) const {
    std::vector<Vector3d> faces;
    Vector3d sum = Vector3d::Zero();
    for (const Mating& mating : added.matings) {
      faces.push_back(WayOut(added.module, mating));
      sum += faces.back();
    }
    if (sum.norm() < 0.5) {
      // Faces that look at each other leave the directions across them: the one nearest to up.
      const Vector3d& n = faces.front();
      sum = Vector3d::UnitY() - n * n.y();
      if (sum.norm() < 0.5) sum = Vector3d::UnitZ() - n * n.z();
    }
    added.from_R = sum.normalized();
    added.sideways =
        std::ranges::any_of(faces, [&](const Vector3d& n) { return n.dot(added.from_R) < 0.1; });
  }

  /// The way out of the standing connector of a mating; where it is not known, that from there to
  /// the middle of the module that is put on.
  [[nodiscard]] Vector3d WayOut(int module, const Mating& mating) const {
    const auto& face = plan_.faces_R[mating.standing][mating.standing_connector];
    if (face) return *face;
    const ModuleType& type = model_.TypeOf(robot_, module);
    const Connector& own = type.connectors[mating.own_connector];
    Vector3d middle = Vector3d::Zero();
    int corners = 0;
    for (size_t l = 0; l < type.links.size(); ++l) {
      for (const Vector3d& p : type.links[l].hull) {
        middle += plan_.X_RL[module][l] * p;
        ++corners;
      }
    }
    const Vector3d at = plan_.X_RL[module][own.link] * own.p_MoCo_M;
    const Vector3d way = corners > 0 ? Vector3d(middle / corners - at) : Vector3d::Zero();
    return way.norm() > 1e-9 ? Vector3d(way.normalized()) : Vector3d::UnitY();
  }

  const Model& model_;
  const Robot& robot_;
  std::vector<std::vector<int>> dockings_of_;
  std::vector<int> parent_;
  AssemblyPlan plan_;
};

}  // namespace

AssemblyPlan PlanAssembly(const Model& model, const Robot& robot) {
  return Planner(model, robot).Plan();
}

}  // namespace morphbus::model
