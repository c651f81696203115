#include "compiler/congruence/search.h"

#include <algorithm>
#include <map>
#include <utility>

namespace morphbus::congruence {

Search::Search(const Assembly& a, const Assembly& b, Classes classes, int64_t max_steps)
    : a_(a),
      b_(b),
      classes_(std::move(classes)),
      max_steps_(max_steps),
      length_tolerance_(kGeometryTolerance * std::max(a.extent_m, b.extent_m)),
      slide_tolerance_(kLimitTolerance * std::max(a.extent_m, b.extent_m)),
      R_(a.bodies.size(), {length_tolerance_, kGeometryTolerance}),
      body_to_(a.bodies.size(), -1),
      body_from_(b.bodies.size(), -1),
      joint_to_(a.joints.size(), Option{-1, 1.0}),
      joint_from_(b.joints.size(), -1) {}

/// A body of a that the fewest bodies are like, b having some too; -1 if there is none.
int Search::SeedBody() const {
  std::map<uint64_t, std::pair<int, int>> members;
  for (const uint64_t c : classes_.bodies[0]) ++members[c].first;
  for (const uint64_t c : classes_.bodies[1]) ++members[c].second;
  int best = -1;
  int fewest = 0;
  for (size_t b = 0; b < a_.bodies.size(); ++b) {
    const auto& [in_a, in_b] = members[classes_.bodies[0][b]];
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
    if (!a_.joints[j].slide && a_.FootFrom(seed, j).norm() > length_tolerance_) return j;
  }
  return best;
}

void Search::Run(const std::function<bool(const Mapping&)>& found) {
  found_ = &found;
  const int seed = SeedBody();
  if (seed < 0) return;
  const int joint = SeedJoint(seed);
  for (size_t image = 0; image < b_.bodies.size() && !stopped_; ++image) {
    if (classes_.bodies[1][image] != classes_.bodies[0][seed]) continue;
    const int to = static_cast<int>(image);
    if (joint < 0) {
      PlaceSeed(seed, to, joint, {-1, 1.0});
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
}

void Search::TrySeed(int seed, int image, int joint, const Option& option) {
  if (classes_.joints[0][joint] != classes_.joints[1][option.to]) return;
  if (!SameRange(a_.joints[joint], b_.joints[option.to], slide_tolerance_)) return;
  PlaceSeed(seed, image, joint, option);
  ++steps_;
  if (Commit(seed, joint, option)) Grow();
  choices_.clear();
  Undo({});
}

/// Matches joint after joint until all are (a mapping) or one has no counterpart; then goes back.
void Search::Grow() {
  while (!stopped_) {
    const int joint = NextJoint();
    if (joint < 0) {
      if (order_.size() == a_.bodies.size()) Report();
      if (!TakeNext()) return;
      continue;
    }
    const int body = order_[head_];
    std::vector<Option> options = OptionsFor(body, joint);
    if (options.empty()) {
      NoteStuck(body, joint);
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
    if (Commit(body, joint, option)) return true;
    Undo(before);
    NoteStuck(body, joint);
  }
  return false;
}

int Search::NextJoint() {
  for (; head_ < order_.size(); ++head_, slot_ = 0) {
    const std::vector<int>& joints = a_.bodies[order_[head_]].joints;
    for (; slot_ < joints.size(); ++slot_) {
      if (joint_to_[joints[slot_]].to < 0) return joints[slot_];
    }
  }
  return -1;
}

std::vector<Search::Option> Search::OptionsFor(int body, int joint) const {
  std::vector<Option> options;
  const int image = body_to_[body];
  const int other = a_.joints[joint].Other(body);
  for (const int to : b_.bodies[image].joints) {
    if (joint_from_[to] >= 0) continue;
    if (classes_.joints[0][joint] != classes_.joints[1][to]) continue;
    if (!SameRange(a_.joints[joint], b_.joints[to], slide_tolerance_)) continue;
    const int other_image = b_.joints[to].Other(image);
    if ((other == body) != (other_image == image)) continue;
    if (body_to_[other] >= 0 ? body_to_[other] != other_image : body_from_[other_image] >= 0) {
      continue;
    }
    if (classes_.bodies[0][other] != classes_.bodies[1][other_image]) continue;
    for (const double sign : {1.0, -1.0}) {
      if (Plausible(body, joint, {to, sign})) options.push_back({to, sign});
    }
  }
  return options;
}

/// Quick, so that most joints have one option: is the axis where it should be, if that is known?
bool Search::Plausible(int body, int joint, const Option& option) const {
  if (!R_.settled(body)) return true;
  const int image = body_to_[body];
  const Eigen::Matrix3d R = R_.Value(body);
  const Eigen::Vector3d axis = option.sign * b_.joints[option.to].AxisFrom(image);
  if ((R * a_.joints[joint].AxisFrom(body) - axis).norm() > kGeometryTolerance) return false;
  if (a_.joints[joint].slide) return true;
  const Eigen::Vector3d gap = R * a_.FootFrom(body, joint) - b_.FootFrom(image, option.to);
  return gap.norm() <= length_tolerance_;
}

void Search::NoteStuck(int body, int joint) {
  // An attempt in which every body goes to its namesake says most to whoever changed a copy.
  const int matched = static_cast<int>(order_.size());
  if (stuck_ && stuck_->promise >= 2 * matched) return;
  const bool namesakes = std::all_of(order_.begin(), order_.end(),
                                     [this](int from) { return body_to_[from] == from; });
  const int promise = namesakes ? 2 * matched : matched;
  if (stuck_ && stuck_->promise >= promise) return;
  Stuck& stuck = stuck_.emplace();
  stuck.promise = promise;
  stuck.bodies = matched;
  stuck.body = body;
  stuck.image = body_to_[body];
  stuck.joint = joint;
  stuck.settled = R_.settled(body);
  stuck.R = R_.Value(body);
  for (const int from : joint_from_) stuck.taken.push_back(from >= 0);
}

Search::Mark Search::mark() const {
  return {order_.size(), joints_order_.size(), R_.mark(), head_, slot_};
}

void Search::Undo(const Mark& mark) {
  for (; joints_order_.size() > mark.joints; joints_order_.pop_back()) {
    Option& option = joint_to_[joints_order_.back()];
    joint_from_[option.to] = -1;
    option.to = -1;
  }
  for (; order_.size() > mark.bodies; order_.pop_back()) {
    const int body = order_.back();
    body_from_[body_to_[body]] = -1;
    body_to_[body] = -1;
    R_.Forget(body);
  }
  R_.Undo(mark.rotations);
  head_ = mark.head;
  slot_ = mark.slot;
}

}  // namespace morphbus::congruence
