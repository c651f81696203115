#include "compiler/congruence/mappings.h"

#include <algorithm>
#include <set>
#include <string>

#include "compiler/base/disjoint_sets.h"

namespace morphbus::congruence {
namespace {

/// Of the names of the modules with a link in the body that which comes first.
std::string FirstName(const ScrewGraph& graph, int body) {
  std::set<std::string> names;
  for (const model::LinkRef& link : graph.bodies[body].links) {
    names.insert(graph.robot->modules[link.module].name);
  }
  return *names.begin();
}

/// Counts the symmetries of an assembly.
class SymmetryCounter {
 public:
  SymmetryCounter(const ScrewGraph& a, const Classes& classes, Steps& steps)
      : steps_(steps),
        search_(a, a, classes, PlanByParts(a, SeedBody(a, a, classes)), steps),
        bodies_(static_cast<int>(a.bodies.size())),
        orbits_(bodies_) {}

  MappingCount Count() {
    // The group's order is the size of the seed's orbit times that of the seed's stabilizer (orbit
    // and stabilizer theorem). The second factor matters only as far as the product stays below the
    // limit.
    int64_t count = CountOrbit();
    if (count <= kMaxCounted) count *= CountInPlace(kMaxCounted / count);
    if (count > kMaxCounted) return {kMaxCounted, false};
    // Where the steps ran out, kMaxCounted itself would say that there are more.
    if (steps_.gave_up()) return {std::min(count, kMaxCounted - 1), false};
    return {count, true};
  }

 private:
  /// The number of bodies to which symmetries take the seed, or more than kMaxCounted. For each
  /// orbit of bodies one attempt tells whether symmetries take the seed there.
  int64_t CountOrbit() {
    const int seed = search_.plan().seed;
    std::vector<int> out_of_reach;
    int64_t size = 1;
    for (const int image : search_.Images()) {
      const auto together = [&](int other) { return orbits_.Find(other) == orbits_.Find(image); };
      // Bodies of one orbit are all in reach of the seed, or none is: one attempt for each orbit.
      if (together(seed) || std::any_of(out_of_reach.begin(), out_of_reach.end(), together)) {
        continue;
      }
      search_.Begin(image);
      if (!search_.MatchAll()) {
        if (steps_.gave_up()) break;
        out_of_reach.push_back(image);
        continue;
      }
      // The symmetry takes other bodies to each other too.
      for (int body = 0; body < bodies_; ++body) {
        orbits_.Unite(body, search_.matched().ImageOf(body));
      }
      size = 0;
      for (int body = 0; body < bodies_; ++body)
        size += orbits_.Find(body) == orbits_.Find(seed) ? 1 : 0;
      if (size > kMaxCounted) break;
    }
    return size;
  }

  /// The number of symmetries that take the seed to itself, or some number above `most`.
  int64_t CountInPlace(int64_t most) {
    // All joints are matched with themselves in turn, each after its other ways were tried: a chain
    // of stabilizers, whose orders are multiplied (after Schreier and Sims).
    Correspondence& matched = search_.matched();
    search_.Begin(search_.plan().seed);
    int64_t count = 1;
    for (int step = 0; step < search_.num_steps() && !steps_.gave_up(); ++step) {
      // How many counterparts can the joint have if all joints before it stay where they are?
      const std::vector<JointImage> counterparts = search_.Prepare(step);
      const JointImage itself{search_.plan().steps[step].joint, 1.0};
      const Correspondence::Mark before = matched.mark();
      int64_t ways = 1;
      for (const JointImage& to : counterparts) {
        if (to.to == itself.to && to.sign == itself.sign) continue;
        if (search_.Take(step, to) && search_.Match(step + 1, search_.EndOfEffect(step))) ++ways;
        matched.Undo(before);
        if (count * ways > most) return count * ways;
      }
      // From now on this joint stays where it is, and the next factor is that of its stabilizer.
      count *= ways;
      search_.Take(step, itself);
    }
    return count;
  }

  Steps& steps_;
  Search search_;
  int bodies_;
  DisjointSets orbits_;  ///< Of bodies.
};

}  // namespace

bool ComesBefore(const model::Robot& b, const Mapping& x, const Mapping& y) {
  if (x.keeps_frame != y.keeps_frame) return x.keeps_frame;
  for (size_t m = 0; m < x.module_to.size(); ++m) {
    const int to_x = x.module_to[m];
    const int to_y = y.module_to[m];
    if (to_x == to_y) continue;
    // A module that goes to one module comes before one whose joints go to several.
    if (to_x < 0 || to_y < 0) return to_x >= 0;
    return b.modules[to_x].name < b.modules[to_y].name;
  }
  // The same modules: some order, always the same one.
  for (size_t j = 0; j < x.joints.size(); ++j) {
    if (x.joints[j].to != y.joints[j].to) return x.joints[j].to < y.joints[j].to;
    if (x.joints[j].sign != y.joints[j].sign) return x.joints[j].sign > y.joints[j].sign;
  }
  return x.body_to < y.body_to;
}

std::optional<Mapping> MappingInFrame(const ScrewGraph& a, const ScrewGraph& b,
                                      const Classes& classes, Steps& steps) {
  // The root link's body stays where it is, as seen from the robot frame.
  const int root = a.RootBody();
  const int root_b = b.RootBody();
  const Eigen::Vector3d moved = a.bodies[root].p_RoTo - b.bodies[root_b].p_RoTo;
  // The robot frame is kept only if the root's body is at the same place in it,
  if (moved.norm() > LengthTolerance(a, b)) return std::nullopt;
  // of the same class, and not turned, which is fixed before the search begins.
  if (classes.bodies[0][root] != classes.bodies[1][root_b]) return std::nullopt;
  Search search(a, b, classes, PlanByParts(a, root), steps);
  search.Begin(root_b);
  search.matched().R().SetWhole(root, Eigen::Matrix3d::Identity());
  if (!search.MatchAll()) return std::nullopt;
  return search.matched().ToMapping();
}

std::optional<Mapping> FirstMapping(const ScrewGraph& a, const ScrewGraph& b,
                                    const Classes& classes, Steps& steps) {
  if (std::optional<Mapping> in_frame = MappingInFrame(a, b, classes, steps)) return in_frame;
  const int seed = SeedBody(a, b, classes);
  if (seed < 0) return std::nullopt;
  // Any place will do if the search by parts gets to the end from it.
  Search search(a, b, classes, PlanByParts(a, seed), steps);
  std::vector<int> images = search.Images();
  std::stable_sort(images.begin(), images.end(),
                   [&](int x, int y) { return FirstName(b, x) < FirstName(b, y); });
  for (const int image : images) {
    search.Begin(image);
    if (search.MatchAll()) return search.matched().ToMapping();
  }
  return std::nullopt;
}

void ForEachMapping(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, Steps& steps,
                    const std::function<bool(const Mapping&)>& found,
                    const Search::OnDeadEnd& on_dead_end) {
  const int seed = SeedBody(a, b, classes);
  if (seed < 0) return;
  // Each way on from each image of the seed is another mapping.
  Search search(a, b, classes, PlanAsOne(a, seed), steps, on_dead_end);
  for (const int image : search.Images()) {
    search.Begin(image);
    for (bool matched = search.MatchAll(); matched; matched = search.Next()) {
      if (!found(search.matched().ToMapping())) return;
    }
    if (steps.gave_up()) return;
  }
}

MappingCount CountSymmetries(const ScrewGraph& a, Steps& steps) {
  return SymmetryCounter(a, RefinedClasses(a, a), steps).Count();
}

}  // namespace morphbus::congruence
