#include "compiler/congruence/search.h"

#include <algorithm>
#include <utility>

namespace morphbus::congruence {

Search::Search(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, Plan plan,
               Steps& steps, OnDeadEnd on_dead_end)
    : matched_(a, b, classes),
      plan_(std::move(plan)),
      steps_(steps),
      on_dead_end_(std::move(on_dead_end)),
      frames_(plan_.steps.size()) {
  // So that the first mapping that is found is the first by names, as far as that goes.
  const auto name = [&](int joint) -> const std::string& {
    return b.robot->modules[b.joints[joint].module].name;
  };
  for (const ScrewBody& body : b.bodies) {
    std::vector<int>& joints = joints_b_.emplace_back(body.joints);
    std::stable_sort(joints.begin(), joints.end(), [&](int x, int y) { return name(x) < name(y); });
  }
}

std::vector<int> Search::Images() const {
  const Classes& classes = matched_.classes();
  std::vector<int> images;
  for (size_t image = 0; image < classes.bodies[1].size(); ++image) {
    const bool alike = classes.bodies[1][image] == classes.bodies[0][plan_.seed];
    if (alike) images.push_back(static_cast<int>(image));
  }
  return images;
}

void Search::Begin(int image) {
  matched_.Undo({});
  matched_.MatchBodies(plan_.seed, image);
  if (plan_.steps.empty()) matched_.R().SetWhole(plan_.seed, Eigen::Matrix3d::Identity());
}

bool Search::Match(int from, int end) {
  choices_.clear();
  end_ = end;
  return GoOn(from);
}

bool Search::Next() {
  int step = end_;
  if (!GoBack(step)) return false;
  DropChoices(step + 1);
  return GoOn(step + 1);
}

/// Carries out the steps from `step` on.
bool Search::GoOn(int step) {
  for (; step < end_; ++step) {
    Prepare(step);
    if (on_dead_end_ && frames_[step].counterparts.empty()) {
      on_dead_end_(matched_, plan_.steps[step].body, plan_.steps[step].joint, false);
    }
    if (!TryCounterparts(step) && !GoBack(step)) return false;
    DropChoices(step + 1);
  }
  return true;
}

/// Goes back from `step` to the latest choice at which something else fits; `step` becomes that of
/// the choice. False if there is none.
bool Search::GoBack(int& step) {
  while (!choices_.empty() && !steps_.gave_up()) {
    // It becomes the latest choice again where another counterpart fits.
    const int choice = choices_.back();
    choices_.pop_back();
    RememberFailure(choice, step);
    step = choice;
    if (TryCounterparts(step)) return true;
  }
  return false;
}

/// Takes the first that fits of the counterparts not tried yet.
bool Search::TryCounterparts(int step) {
  Frame& frame = frames_[step];
  while (frame.next < frame.counterparts.size() && --steps_.left > 0) {
    matched_.Undo(frame.before);
    if (Take(step, frame.counterparts[frame.next++]) && !KnownToFail(step)) {
      if (frame.counterparts.size() > 1) choices_.push_back(step);
      return true;
    }
    matched_.Undo(frame.before);
    if (on_dead_end_) on_dead_end_(matched_, plan_.steps[step].body, plan_.steps[step].joint, true);
  }
  return false;
}

const std::vector<JointImage>& Search::Prepare(int step) {
  // The frame keeps what is needed to come back to this step.
  const auto& [body, joint, end] = plan_.steps[step];
  Frame& frame = frames_[step];
  frame.before = matched_.mark();
  frame.freedom_before = FreedomAt(step);
  frame.next = 0;
  frame.counterparts.clear();
  for (const int to : joints_b_[matched_.ImageOf(body)]) {
    matched_.AddCounterparts(body, joint, to, frame.counterparts);
  }
  return frame.counterparts;
}

bool Search::Take(int step, const JointImage& counterpart) {
  if (!matched_.Commit(plan_.steps[step].body, plan_.steps[step].joint, counterpart)) return false;
  frames_[step].freedom_after = FreedomAt(step);
  return true;
}

int Search::FreedomAt(int step) const { return matched_.R().freedom(plan_.steps[step].body); }

/// Drops the choices that parts which are complete after `done` steps need no more.
void Search::DropChoices(int done) {
  for (const int first : plan_.closing[done]) {
    const Frame& frame = frames_[first];
    const int now = FreedomAt(first);
    // What the part says of its body's turn: nothing; that which its first joint says; or more.
    const int from = now == frame.freedom_before  ? first
                     : now == frame.freedom_after ? first + 1
                                                  : done;
    while (!choices_.empty() && choices_.back() >= from) choices_.pop_back();
  }
}

int Search::EndOfEffect(int step) const {
  // The innermost part whose body was in place and turned for good before it began.
  for (int first = step; first >= 0; --first) {
    const int end = plan_.steps[first].part_end;
    if (end > step && frames_[first].freedom_before == 0) return end;
  }
  return num_steps();
}

// --- What has failed -----------------------------------------------------------------------------

// One part is come to again and again where something before it fits in several ways. That it
// failed is worth knowing then; that it fitted is not, for then the search is not taken back.

Search::PartKey Search::KeyOf(int step) const {
  const auto& [body, joint, end] = plan_.steps[step];
  const JointImage& to = matched_.CounterpartOf(joint);
  return {step, matched_.ImageOf(body), to.to, to.sign > 0.0 ? 1 : -1};
}

/// Is it known that the part which began with `step` fails with the counterpart just taken?
bool Search::KnownToFail(int step) const {
  if (plan_.steps[step].part_end == 0 || frames_[step].freedom_after > 0) return false;
  const auto failed = failed_.find(KeyOf(step));
  if (failed == failed_.end()) return false;
  const Eigen::Matrix3d R = matched_.R().Value(plan_.steps[step].body);
  return std::any_of(
      failed->second.begin(), failed->second.end(),
      [&](const Eigen::Matrix3d& other) { return (other - R).norm() <= kGeometryTolerance; });
}

/// Remembers of the parts begun at `from` or later, and not complete at the step that `failed`, the
/// first.
void Search::RememberFailure(int from, int failed) {
  for (int step = from; step < failed; ++step) {
    if (plan_.steps[step].part_end <= failed) continue;
    if (frames_[step].freedom_after > 0) continue;
    failed_[KeyOf(step)].push_back(matched_.R().Value(plan_.steps[step].body));
    return;
  }
}

}  // namespace morphbus::congruence
