#include "compiler/congruence/backtracker.h"

#include <utility>

#include "compiler/congruence/places.h"

namespace morphbus::congruence {

Backtracker::Backtracker(Correspondence& matched, const Decompositions& pieces, Steps& steps,
                         const Entry& entry, OnDeadEnd on_dead_end)
    : matched_(matched),
      pieces_(pieces),
      steps_(steps),
      entry_(entry),
      on_dead_end_(std::move(on_dead_end)),
      start_(matched.mark()),
      first_(matched.order().size()) {}

int Backtracker::BodyAt(size_t index) const {
  return index == 0 ? entry_.body : matched_.order()[first_ + index - 1];
}

std::vector<int> Backtracker::NewBodies() const {
  return {matched_.order().begin() + static_cast<std::ptrdiff_t>(first_), matched_.order().end()};
}

void Backtracker::Undo(const Mark& mark) {
  matched_.Undo(mark.matched);
  head_ = mark.head;
}

bool Backtracker::Next() {
  bool going = !begun_ || TryNext();
  begun_ = true;
  while (going) {
    // Without anything left to choose the piece is matched as a whole.
    std::optional<Choice> choice = NextChoice();
    if (!choice) return true;
    if (!choice->exhausted()) {
      choices_.push_back(std::move(*choice));
    } else if (on_dead_end_ && choice->joint >= 0) {
      on_dead_end_(choice->body, choice->joint, false);
    }
    going = TryNext();
  }
  matched_.Undo(start_);
  return false;
}

/// Goes back to the latest choice and takes what was not tried there yet, until something fits.
/// False if there is no choice left.
bool Backtracker::TryNext() {
  while (!choices_.empty() && --steps_.left > 0) {
    // The choice itself goes as soon as its last possibility is taken.
    Choice& choice = choices_.back();
    const Mark before = choice.mark;
    const int body = choice.body;
    const int joint = choice.joint;
    const size_t at = choice.next++;
    const auto counterpart = joint >= 0 ? choice.counterparts[at] : Counterpart{-1, 1.0};
    const Eigen::Matrix3d R = joint >= 0 ? Eigen::Matrix3d::Identity() : choice.rotations[at];
    if (choice.exhausted()) choices_.pop_back();

    Undo(before);
    if (joint < 0 ? matched_.R().AlignWhole(body, R) : matched_.Commit(body, joint, counterpart)) {
      return true;
    }
    Undo(before);
    if (on_dead_end_ && joint >= 0) on_dead_end_(body, joint, true);
  }
  choices_.clear();
  return false;
}

/// The next joint to match, with its possible counterparts; after the joints the next body that is
/// still to be turned. Nothing if there is neither.
std::optional<Backtracker::Choice> Backtracker::NextChoice() {
  Choice choice;
  choice.joint = NextJoint(&choice.body);
  choice.mark = {matched_.mark(), head_};
  if (choice.joint >= 0) {
    choice.counterparts = CounterpartsOf(choice.body, choice.joint);
    return choice;
  }
  // Other pieces will be matched at the body, each by itself, so they have to find it turned.
  choice.body = NextOpenBody();
  if (choice.body < 0) return std::nullopt;
  const int image = matched_.ImageOf(choice.body);
  for (const Place& place : PlacesOn(matched_, pieces_.a, choice.body, image)) {
    choice.rotations.push_back(place.R);
  }
  return choice;
}

/// A joint of the piece that touches a matched body, `*body`, and is not matched; -1 if there is
/// none.
int Backtracker::NextJoint(int* body) {
  const std::vector<int>& own = pieces_.a.joints[entry_.piece];
  for (; head_ < num_bodies(); ++head_) {
    *body = BodyAt(head_);
    // Of the piece's joints and the body's the shorter list: a hub has many joints, most pieces
    // few.
    const std::vector<int>& there = matched_.a().bodies[*body].joints;
    for (const int joint : own.size() < there.size() ? own : there) {
      if (pieces_.a.of_joint[joint] != entry_.piece || matched_.JointImageOf(joint) >= 0) continue;
      if (matched_.a().joints[joint].Touches(*body)) return joint;
    }
  }
  return -1;
}

std::vector<Counterpart> Backtracker::CounterpartsOf(int body, int joint) const {
  std::vector<Counterpart> counterparts;
  const int image = matched_.ImageOf(body);
  const std::vector<int>& own = pieces_.b.joints[entry_.image];
  const std::vector<int>& there = matched_.b().bodies[image].joints;
  for (const int to : own.size() < there.size() ? own : there) {
    if (pieces_.b.of_joint[to] != entry_.image) continue;
    if (!matched_.b().joints[to].Touches(image)) continue;
    matched_.AddCounterparts(body, joint, to, counterparts);
  }
  return counterparts;
}

/// A new body whose joints determine how it is turned, but not those of this piece; -1 if none.
int Backtracker::NextOpenBody() const {
  for (size_t i = 1; i < num_bodies(); ++i) {
    const int body = BodyAt(i);
    if (!pieces_.a.coaxial[body] && !matched_.R().settled(body)) return body;
  }
  return -1;
}

}  // namespace morphbus::congruence
