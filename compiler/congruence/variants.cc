#include "compiler/congruence/variants.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>

#include "compiler/congruence/classes.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/placements.h"

namespace morphbus::congruence {
namespace {

using model::Docking;
using model::Pose;

/// Bounds: tries of one placement for one module, of further ways to make dockings, and draws in a
/// row that bring nothing new.
constexpr int64_t kMaxSteps = 2'000'000;
constexpr int kMaxJoinings = 10'000;
constexpr int kMaxIdleDraws = 200;
constexpr int kMaxRejected = 10'000;

/// A way to join two modules, X and Y, seen from X.
struct Way {
  int connection = 0;    ///< Index into Model::connection_types.
  int option = 0;        ///< Index into its options.
  bool swapped = false;  ///< The second module plays the connection's member a.
  int connector_x = 0;
  int connector_y = 0;
};

/// Chooses a placement for each module, depth first over the modules, such that each docking of the
/// robot can be made by some option of the model's connections; a choice that is complete becomes
/// a robot, which is compared with the one it is a variant of.
class VariantFinder {
 public:
  VariantFinder(const model::Model& model, const model::Robot& robot, const VariantOptions& options)
      : model_(model), robot_(robot), options_(options), random_(options.seed.value_or(0)) {
    for (const model::ModuleInstance& module : robot.modules) {
      auto& placements = placements_[module.type];
      if (placements.empty()) placements = PlacementsOf(model, module.type);
    }
    SortModules();
    seen_.insert(KeyOf(robot.dockings));
  }

  std::vector<Variant> Find() {
    // In order: one search through all choices. At random: searches anew, each in a random order up
    // to its first variant, until too many in a row find nothing new.
    if (!options_.seed) {
      Visit();
      return std::move(found_);
    }
    for (int idle = 0; idle < kMaxIdleDraws && found_.size() < options_.max; ++idle) {
      found_before_ = found_.size();
      stop_after_one_ = true;
      Visit();
      if (found_.size() > found_before_) idle = -1;
    }
    return std::move(found_);
  }

 private:
  /// What tells robots of the same modules apart: how each docking is made.
  using Key = std::vector<std::array<int, 3>>;

  static Key KeyOf(const std::vector<Docking>& dockings) {
    Key key;
    for (const Docking& d : dockings) key.push_back({d.connection_type, d.option, d.module_a});
    return key;
  }

  [[nodiscard]] const std::vector<Placement>& PlacementsOfModule(int module) const {
    return placements_.at(robot_.modules[module].type);
  }

  /// Fills in order_, breadth first from the root module, and back_.
  void SortModules() {
    // The dockings at each module.
    std::vector<std::vector<int>> at(robot_.modules.size());
    for (size_t d = 0; d < robot_.dockings.size(); ++d) {
      at[robot_.dockings[d].module_a].push_back(static_cast<int>(d));
      at[robot_.dockings[d].module_b].push_back(static_cast<int>(d));
    }
    // order_ itself is the queue of the walk.
    std::vector<int> rank(robot_.modules.size(), -1);
    order_ = {robot_.root_module};
    rank[robot_.root_module] = 0;
    for (size_t i = 0; i < order_.size(); ++i) {
      for (const int d : at[order_[i]]) {
        for (const int module : {robot_.dockings[d].module_a, robot_.dockings[d].module_b}) {
          if (rank[module] >= 0) continue;
          rank[module] = static_cast<int>(order_.size());
          order_.push_back(module);
        }
      }
    }
    // Of two modules that are joined the later one hangs on the other.
    back_.resize(order_.size());
    for (size_t d = 0; d < robot_.dockings.size(); ++d) {
      const Docking& docking = robot_.dockings[d];
      const int later = std::max(rank[docking.module_a], rank[docking.module_b]);
      back_[later].push_back(static_cast<int>(d));
    }
  }

  /// The ways that join the placed modules of docking `d` as the docking joined them.
  const std::vector<Way>& Alternatives(int d, int placement_a, int placement_b) {
    // They are the same for all dockings of one option whose modules are placed alike.
    const Docking& docking = robot_.dockings[d];
    const auto [it, fresh] = alternatives_.try_emplace(
        {docking.connection_type, docking.option, placement_a, placement_b});
    if (!fresh) return it->second;
    const int type_a = robot_.modules[docking.module_a].type;
    const int type_b = robot_.modules[docking.module_b].type;
    const model::ModuleType& a = model_.module_types[type_a];
    const model::ModuleType& b = model_.module_types[type_b];
    const Placement& pa = PlacementsOfModule(docking.module_a)[placement_a];
    const Placement& pb = PlacementsOfModule(docking.module_b)[placement_b];
    const int body_a = pa.body_of[a.connectors[docking.connector_a].link];
    const int body_b = pb.body_of[b.connectors[docking.connector_b].link];
    const model::ConnectionOption& option =
        model_.connection_types[docking.connection_type].options[docking.option];
    // The images of the two joined bodies have to come to stand as the bodies did: C_A X_AB C_B^-1.
    Pose wanted = option.X_AB;
    wanted.linear() = pa.C[body_a] * option.X_AB.linear() * pb.C[body_b].transpose();
    wanted.translation() = pa.C[body_a] * option.X_AB.translation();
    const double tolerance = kGeometryTolerance * std::max(model::ExtentOf(a), model::ExtentOf(b));
    for (size_t c = 0; c < model_.connection_types.size(); ++c) {
      const model::ConnectionType& connection = model_.connection_types[c];
      for (const bool swapped : {false, true}) {
        if ((swapped ? connection.type_b : connection.type_a) != type_a) continue;
        if ((swapped ? connection.type_a : connection.type_b) != type_b) continue;
        for (size_t o = 0; o < connection.options.size(); ++o) {
          // The way as the docking's module a sees it: it may be the connection's member b.
          const model::ConnectionOption& way = connection.options[o];
          int at_x = way.connector_a;
          int at_y = way.connector_b;
          Pose X_XY = way.X_AB;
          if (swapped) {
            std::swap(at_x, at_y);
            X_XY = X_XY.inverse();
          }
          if (pa.body_of[a.connectors[at_x].link] != pa.body_to[body_a]) continue;
          if (pb.body_of[b.connectors[at_y].link] != pb.body_to[body_b]) continue;
          if ((X_XY.translation() - wanted.translation()).norm() > tolerance) continue;
          if ((X_XY.linear() - wanted.linear()).norm() > 2.0 * kGeometryTolerance) continue;
          it->second.push_back({static_cast<int>(c), static_cast<int>(o), swapped, at_x, at_y});
        }
      }
    }
    // Where nothing changes the robot's own connection goes first.
    std::stable_sort(it->second.begin(), it->second.end(), [&](const Way& x, const Way& y) {
      const auto own = [&](const Way& way) {
        return way.connection == docking.connection_type && way.option == docking.option &&
               !way.swapped;
      };
      return own(x) && !own(y);
    });
    // Two ways with the same connectors are one joining, told from either side: the first counts.
    std::set<std::pair<int, int>> connectors;
    std::erase_if(it->second, [&](const Way& way) {
      return !connectors.emplace(way.connector_x, way.connector_y).second;
    });
    return it->second;
  }

  /// Depth first over the modules; calls JoinModules for each complete choice.
  void Visit() {
    const size_t count = order_.size();
    chosen_.assign(robot_.modules.size(), -1);
    std::vector<std::vector<int>> domains(count);
    std::vector<size_t> next(count, 0);
    size_t depth = 0;
    domains[0] = DomainOf(0);
    int64_t steps = 0;
    while (steps++ < kMaxSteps) {
      const int module = order_[depth];
      // Where all placements of a module are used up, the one before it gets its next.
      if (next[depth] == domains[depth].size()) {
        chosen_[module] = -1;
        if (depth == 0) return;
        --depth;
        continue;
      }
      // A placement with which its dockings can be made leads on to the next module.
      chosen_[module] = domains[depth][next[depth]++];
      if (!Fits(depth)) continue;
      if (depth + 1 < count) {
        ++depth;
        domains[depth] = DomainOf(depth);
        next[depth] = 0;
        continue;
      }
      JoinModules();
      if (Enough() || stop_after_one_ || rejected_ > kMaxRejected) return;
    }
  }

  /// The placements to try for a module, in order or (with a seed) shuffled.
  std::vector<int> DomainOf(size_t depth) {
    std::vector<int> domain(PlacementsOfModule(order_[depth]).size());
    std::iota(domain.begin(), domain.end(), 0);
    if (!options_.seed) return domain;
    // Fisher and Yates's shuffle; by remainders, and not by a distribution of the library, so that
    // it is the same everywhere.
    for (size_t i = domain.size(); i > 1; --i) std::swap(domain[i - 1], domain[random_() % i]);
    return domain;
  }

  /// Can the dockings of this module to those before it be made as all of them are placed?
  bool Fits(size_t depth) {
    return std::all_of(back_[depth].begin(), back_[depth].end(), [this](int d) {
      const Docking& docking = robot_.dockings[d];
      return !Alternatives(d, chosen_[docking.module_a], chosen_[docking.module_b]).empty();
    });
  }

  /// The robot's name with the first number from number_ on that gives a name no robot has.
  std::string NextName() {
    const auto name = [this] { return robot_.name + "_variant_" + std::to_string(number_); };
    while (model_.FindRobot(name()) != nullptr) ++number_;
    return name();
  }

  /// Makes the dockings as the placements chosen ask, in each way in which no connector is used
  /// twice, and calls Finish for it. Depth first over the dockings: two may want one connector, and
  /// the first way of the one may be the only way of the other.
  void JoinModules() {
    model::Robot variant = robot_;
    const size_t count = robot_.dockings.size();
    std::set<std::pair<int, int>> used;  // module, connector
    std::vector<size_t> next(count + 1, 0);
    size_t d = 0;
    for (int tries = 0; tries < kMaxJoinings && !Enough();) {
      // All are made, or all ways of one are used up: the one before it gets its next.
      const bool complete = d == count;
      // The bodies lie as the placements say, in whichever ways they are joined: one joining that
      // is not congruent speaks for all.
      if (complete && !Finish(variant)) return;
      const std::vector<Way>* ways = complete ? nullptr : &AlternativesOf(d);
      if (complete || next[d] == ways->size()) {
        if (d-- == 0) return;
        const Docking& last = variant.dockings[d];
        used.erase({last.module_a, last.connector_a});
        used.erase({last.module_b, last.connector_b});
        continue;
      }
      // The first ways alone, of which most dockings have no other, cost no try.
      tries += next[d] > 0 ? 1 : 0;
      const Docking joined = Joined(robot_.dockings[d], (*ways)[next[d]++]);
      if (used.count({joined.module_a, joined.connector_a}) > 0 ||
          used.count({joined.module_b, joined.connector_b}) > 0) {
        continue;
      }
      used.insert({joined.module_a, joined.connector_a});
      used.insert({joined.module_b, joined.connector_b});
      variant.dockings[d++] = joined;
      next[d] = 0;
    }
  }

  /// The ways of docking `d`, its modules being placed as is chosen.
  const std::vector<Way>& AlternativesOf(size_t d) {
    const Docking& docking = robot_.dockings[d];
    return Alternatives(static_cast<int>(d), chosen_[docking.module_a], chosen_[docking.module_b]);
  }

  /// The docking made in another way. X is its module a; where the connection wants the modules the
  /// other way round, the docking is turned, with its connectors.
  static Docking Joined(const Docking& docking, const Way& way) {
    Docking joined{docking.module_a, way.connector_x, docking.module_b,
                   way.connector_y,  way.connection,  way.option};
    if (way.swapped) {
      std::swap(joined.module_a, joined.module_b);
      std::swap(joined.connector_a, joined.connector_b);
    }
    return joined;
  }

  /// Whether as many variants are found as the present search is for.
  [[nodiscard]] bool Enough() const {
    return found_.size() >= options_.max || (stop_after_one_ && found_.size() > found_before_);
  }

  /// Completes a robot whose dockings are chosen; keeps it if it is new and congruent. False if it
  /// is not congruent.
  bool Finish(model::Robot variant) {
    const Key key = KeyOf(variant.dockings);
    if (seen_.count(key) > 0) return true;

    // Joints get the start values that put the bodies where they were.
    for (size_t m = 0; m < robot_.modules.size(); ++m) {
      const Placement& placement = PlacementsOfModule(static_cast<int>(m))[chosen_[m]];
      for (size_t j = 0; j < placement.joints.size(); ++j) {
        const JointImage& image = placement.joints[j];
        variant.modules[m].start[image.to] = image.sign * robot_.modules[m].start[j] + image.offset;
      }
    }
    MoveFrame(variant);
    variant.name = NextName();

    // It is compared as any other. Where a turn of the root's body is free, only one choice of it
    // keeps the frame.
    const std::optional<MassComparison> masses = CompareInFrame(model_, robot_, model_, variant);
    if (masses) {
      seen_.insert(key);
      found_.push_back({std::move(variant), *masses});
      ++number_;
    } else {
      ++rejected_;
    }
    return masses.has_value();
  }

  /// The robot frame stays where it is, on the link that now stands for the root link.
  void MoveFrame(model::Robot& variant) const {
    const Placement& placement =
        PlacementsOfModule(robot_.root_module)[chosen_[robot_.root_module]];
    const int body = placement.body_of[robot_.root_link];
    const int image = placement.body_to[body];
    if (placement.body_of[variant.root_link] != image) {
      const auto link = std::find(placement.body_of.begin(), placement.body_of.end(), image);
      variant.root_link = static_cast<int>(link - placement.body_of.begin());
    }
    variant.X_LR.linear() = placement.C[body] * robot_.X_LR.linear();
    variant.X_LR.translation() = placement.C[body] * robot_.X_LR.translation();
  }

  const model::Model& model_;
  const model::Robot& robot_;
  const VariantOptions& options_;
  std::mt19937_64 random_;
  std::map<int, std::vector<Placement>> placements_;  ///< By module type.
  /// By connection type, option, placements of a and b.
  std::map<std::array<int, 4>, std::vector<Way>> alternatives_;
  std::vector<int> order_;              ///< Modules, in the order in which they are placed.
  std::vector<std::vector<int>> back_;  ///< By index into order_: dockings to earlier modules.
  std::vector<int> chosen_;             ///< [module]: index of its placement.
  std::set<Key> seen_;                  ///< The robot itself and the variants found.
  std::vector<Variant> found_;
  int number_ = 1;    ///< Of the next variant.
  int rejected_ = 0;  ///< Robots that could be built, but were not congruent in frame.
  bool stop_after_one_ = false;
  size_t found_before_ = 0;  ///< Before the present search.
};

}  // namespace

std::vector<Variant> Variants(const model::Model& model, const model::Robot& robot,
                              const VariantOptions& options) {
  if (robot.modules.empty() || options.max == 0) return {};
  return VariantFinder(model, robot, options).Find();
}

}  // namespace morphbus::congruence
