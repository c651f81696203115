#include "compiler/congruence/mapping_search.h"

#include <algorithm>
#include <map>
#include <utility>

#include "compiler/congruence/places.h"

namespace morphbus::congruence {
namespace {

/// Adds a number to a hash.
uint64_t HashOf(uint64_t hash, uint64_t value) {
  hash ^= value + 0x9e3779b97f4a7c15u + (hash << 6) + (hash >> 2);
  return hash * 0xff51afd7ed558ccdu;
}

/// By body of a: the body of b that holds the namesake (by module and link) of its first link; -1
/// if there is none.
std::vector<int> NamesakesOf(const ScrewGraph& a, const ScrewGraph& b) {
  // The modules of b by name.
  std::map<std::string, int> modules;
  for (size_t m = 0; m < b.robot->modules.size(); ++m) {
    modules.emplace(b.robot->modules[m].name, static_cast<int>(m));
  }
  std::vector<int> namesakes;
  for (const ScrewBody& body : a.bodies) {
    // A module or a link of that name may be missing.
    const model::LinkRef& first = body.links.front();
    const auto module = modules.find(a.robot->modules[first.module].name);
    namesakes.push_back(-1);
    if (module == modules.end()) continue;
    const std::string& name = a.model->TypeOf(*a.robot, first.module).links[first.link].name;
    const std::vector<model::Link>& links = b.model->TypeOf(*b.robot, module->second).links;
    for (size_t l = 0; l < links.size(); ++l) {
      if (links[l].name == name) namesakes.back() = b.body_of[module->second][l];
    }
  }
  return namesakes;
}

}  // namespace

MappingSearch::MappingSearch(const ScrewGraph& a, const ScrewGraph& b, Classes classes,
                             int64_t max_steps)
    : a_(a),
      b_(b),
      matched_(a, b, std::move(classes)),
      whole_{AsOnePiece(a, matched_.length_tolerance()),
             AsOnePiece(b, matched_.length_tolerance())},
      steps_{max_steps},
      namesakes_(NamesakesOf(a, b)) {}

void MappingSearch::Run(const std::function<bool(const Mapping&)>& found) {
  const int seed = SeedBody(matched_.classes(), whole_.a);
  if (seed < 0) return;
  const Classes& classes = matched_.classes();
  bool go_on = true;
  for (size_t image = 0; image < b_.bodies.size() && go_on; ++image) {
    if (classes.bodies[1][image] != classes.bodies[0][seed]) continue;
    // How the seed is turned is for its joints to say; a body alone keeps its orientation.
    matched_.MatchBodies(seed, static_cast<int>(image));
    if (a_.joints.empty()) matched_.R().SetWhole(seed, Eigen::Matrix3d::Identity());
    Backtracker search(
        matched_, whole_, steps_, {0, 0, seed},
        [this](int body, int joint, bool tried) { NoteDeadEnd(body, joint, tried); });
    while (go_on && search.Next()) {
      const Mapping mapping = matched_.ToMapping();
      if (IsNew(mapping)) go_on = found(mapping);
    }
    matched_.Undo({});
    go_on = go_on && !steps_.gave_up();
  }
  if (dead_end_ || a_.joints.empty()) return;
  // All attempts ended at once: no body that the seed may go to has a joint like its first.
  dead_end_.emplace();
  dead_end_->body = seed;
  dead_end_->joint = a_.bodies[seed].joints[0];
}

void MappingSearch::NoteDeadEnd(int body, int joint, bool tried) {
  // An attempt that found nothing to try for its first joint has nothing to tell.
  const std::vector<int>& order = matched_.order();
  if (order.size() == 1 && matched_.mark().joints == 0 && !tried) return;
  const int count = static_cast<int>(order.size());
  if (dead_end_ && dead_end_->promise >= 2 * count) return;
  // An attempt in which every body goes to its namesake says most to whoever changed a copy.
  const bool namesakes = std::all_of(order.begin(), order.end(), [this](int from) {
    return matched_.ImageOf(from) == namesakes_[from];
  });
  const int promise = namesakes ? 2 * count : count;
  if (dead_end_ && dead_end_->promise >= promise) return;
  dead_end_.emplace(DeadEnd{promise, body, joint, tried, matched_});
}

/// A mapping may be come to twice where joints within a body go either way round.
bool MappingSearch::IsNew(const Mapping& mapping) {
  uint64_t hash = 0;
  for (const int to : mapping.body_to) hash = HashOf(hash, static_cast<uint64_t>(to));
  for (const JointImage& image : mapping.joints) {
    hash = HashOf(hash, static_cast<uint64_t>(image.to) * 2 + (image.sign > 0.0 ? 1 : 0));
  }
  return seen_.insert(hash).second;
}

}  // namespace morphbus::congruence
