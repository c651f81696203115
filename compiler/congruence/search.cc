#include "compiler/congruence/search.h"

#include <algorithm>
#include <map>
#include <utility>

namespace morphbus::congruence {
namespace {

uint64_t HashOf(uint64_t hash, uint64_t value) {
  hash ^= value + 0x9e3779b97f4a7c15u + (hash << 6) + (hash >> 2);
  return hash * 0xff51afd7ed558ccdu;
}

/// By module and link name: the body of b that holds the namesake of the first link of each of a's.
std::vector<int> NamesakesOf(const Assembly& a, const Assembly& b) {
  std::map<std::string, int> modules;
  for (size_t m = 0; m < b.robot->modules.size(); ++m) {
    modules.emplace(b.robot->modules[m].name, static_cast<int>(m));
  }
  std::vector<int> namesakes;
  for (const AssemblyBody& body : a.bodies) {
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

Search::Search(const Assembly& a, const Assembly& b, Classes classes, int64_t max_steps)
    : a_(a),
      b_(b),
      matched_(a, b, std::move(classes)),
      max_steps_(max_steps),
      namesakes_(NamesakesOf(a, b)) {}

/// A body of a that the fewest bodies are like, b having some too; -1 if there is none.
int Search::SeedBody() const {
  const Classes& classes = matched_.classes();
  std::map<uint64_t, std::pair<int, int>> members;
  for (const uint64_t c : classes.bodies[0]) ++members[c].first;
  for (const uint64_t c : classes.bodies[1]) ++members[c].second;
  int best = -1;
  int fewest = 0;
  for (size_t b = 0; b < a_.bodies.size(); ++b) {
    const auto& [in_a, in_b] = members[classes.bodies[0][b]];
    if (in_b == 0 || (best >= 0 && std::max(in_a, in_b) >= fewest)) continue;
    best = static_cast<int>(b);
    fewest = std::max(in_a, in_b);
  }
  return best;
}

/// The joint of the seed that fixes its rotation best; -1 if it has none.
int Search::SeedJoint(int seed) const {
  int best = -1;
  for (const int j : a_.bodies[seed].joints) {
    if (best < 0) best = j;
    const double out = a_.FootFrom(seed, j).norm();
    if (!a_.joints[j].slide && out > matched_.length_tolerance()) return j;
  }
  return best;
}

void Search::Run(const std::function<bool(const Mapping&)>& found) {
  found_ = &found;
  const int seed = SeedBody();
  if (seed < 0) return;
  const int joint = SeedJoint(seed);
  const Classes& classes = matched_.classes();
  for (size_t image = 0; image < b_.bodies.size() && !stopped_; ++image) {
    if (classes.bodies[1][image] != classes.bodies[0][seed]) continue;
    const int to = static_cast<int>(image);
    if (joint < 0) {
      matched_.PlaceSeed(seed, to, joint, {-1, 1.0});
      Grow();
      Undo({});
      continue;
    }
    for (const int to_joint : b_.bodies[image].joints) {
      for (const double sign : {1.0, -1.0}) {
        if (!stopped_) TrySeed(seed, to, joint, {to_joint, sign});
      }
    }
  }
  if (stuck_ || joint < 0) return;
  // No joint of any body that it may go to is of this kind and range.
  Stuck& stuck = stuck_.emplace();
  stuck.body = seed;
  stuck.joint = joint;
}

void Search::TrySeed(int seed, int image, int joint, const Option& option) {
  if (!matched_.MayCorrespond(joint, option.to)) return;
  matched_.PlaceSeed(seed, image, joint, option);
  const Mark placed = mark();
  ++steps_;
  if (matched_.Commit(seed, joint, option)) {
    Grow();
  } else {
    Undo(placed);
    NoteStuck(seed, joint, true);
  }
  choices_.clear();
  Undo({});
}

/// Matches joint after joint until all are (a mapping) or one has no counterpart; then goes back.
void Search::Grow() {
  while (!stopped_) {
    const int joint = NextJoint();
    if (joint < 0) {
      if (matched_.order().size() == a_.bodies.size()) Report();
      if (!TakeNext()) return;
      continue;
    }
    const int body = matched_.order()[head_];
    std::vector<Option> options = matched_.OptionsFor(body, joint);
    if (options.empty()) {
      NoteStuck(body, joint, false);
    } else {
      choices_.push_back({mark(), body, joint, std::move(options)});
    }
    if (!TakeNext()) return;
  }
}

/// Takes the next untried option of the latest choice; false if there is none any more.
bool Search::TakeNext() {
  while (!choices_.empty() && !stopped_) {
    if (++steps_ >= max_steps_) stopped_ = true;
    Choice& choice = choices_.back();
    const Mark before = choice.mark;
    const int body = choice.body;
    const int joint = choice.joint;
    const Option option = choice.options[choice.next++];
    if (choice.next == choice.options.size()) choices_.pop_back();
    Undo(before);
    if (matched_.Commit(body, joint, option)) return true;
    Undo(before);
    NoteStuck(body, joint, true);
  }
  return false;
}

int Search::NextJoint() {
  const std::vector<int>& order = matched_.order();
  for (; head_ < order.size(); ++head_, slot_ = 0) {
    const std::vector<int>& joints = a_.bodies[order[head_]].joints;
    for (; slot_ < joints.size(); ++slot_) {
      if (matched_.JointImageOf(joints[slot_]) < 0) return joints[slot_];
    }
  }
  return -1;
}

/// `failed`: a counterpart was tried, and Commit told what it lacks.
void Search::NoteStuck(int body, int joint, bool failed) {
  // An attempt in which every body goes to its namesake says most to whoever changed a copy.
  const std::vector<int>& order = matched_.order();
  const int matched = static_cast<int>(order.size());
  if (stuck_ && stuck_->promise >= 2 * matched) return;
  const bool namesakes = std::all_of(order.begin(), order.end(), [this](int from) {
    return matched_.ImageOf(from) == namesakes_[from];
  });
  const int promise = namesakes ? 2 * matched : matched;
  if (stuck_ && stuck_->promise >= promise) return;
  Stuck& stuck = stuck_.emplace();
  stuck.promise = promise;
  stuck.bodies = matched;
  stuck.body = body;
  stuck.image = matched_.ImageOf(body);
  stuck.joint = joint;
  stuck.first = matched_.mark().joints == 0;
  stuck.settled = matched_.R().settled(body);
  stuck.R = matched_.R().Value(body);
  for (size_t j = 0; j < b_.joints.size(); ++j) {
    stuck.taken.push_back(matched_.JointTaken(static_cast<int>(j)));
  }
  for (size_t i = 0; i < a_.bodies.size(); ++i) {
    stuck.body_to.push_back(matched_.ImageOf(static_cast<int>(i)));
  }
  for (size_t i = 0; i < b_.bodies.size(); ++i) {
    stuck.occupied.push_back(matched_.BodyTaken(static_cast<int>(i)));
  }
  if (failed) stuck.failure = matched_.failure();
}

void Search::Undo(const Mark& mark) {
  matched_.Undo(mark.matched);
  head_ = mark.head;
  slot_ = mark.slot;
}

void Search::Report() {
  const Mapping mapping = matched_.ToMapping();
  uint64_t hash = 0;
  for (const int to : mapping.body_to) hash = HashOf(hash, static_cast<uint64_t>(to));
  for (const JointImage& image : mapping.joints) {
    hash = HashOf(hash, static_cast<uint64_t>(image.to) * 2 + (image.sign > 0.0 ? 1 : 0));
  }
  if (!seen_.insert(hash).second) return;
  if (!(*found_)(mapping)) stopped_ = true;
}

}  // namespace morphbus::congruence
