#pragma once
// Backtracking search for the ways to match one piece of an assembly with one of another.
// Internal to compiler/congruence.

#include <functional>
#include <optional>
#include <vector>

#include "compiler/congruence/correspondence.h"
#include "compiler/congruence/decomposition.h"

namespace morphbus::congruence {

/// Both assemblies in pieces: a's bodies and joints are matched with b's.
struct Decompositions {
  Decomposition a;
  Decomposition b;
};

/// A budget of joints to try, shared by all searches that serve one question. With it the time of
/// any answer is bounded.
struct Steps {
  int64_t left = 0;  ///< How many may still be tried.
  [[nodiscard]] bool gave_up() const { return left <= 0; }
};

/// A task for the search: match `piece` of a with `image` of b, where they share `body` of a, which
/// has its counterpart already.
struct Entry {
  /// The piece, by its number in the decomposition of a.
  int piece;
  /// The piece it is to go to, by its number in the decomposition of b.
  int image;
  /// The body of a at which the search enters the piece.
  int body;
};

/// Brings a correspondence to each way of matching one piece in turn.
///
/// The search goes breadth first over the piece's joints, from the body at which it is entered.
/// Each joint that has no counterpart yet is matched with one that class, place and direction
/// allow; Correspondence works out what follows for the body at its other end. Where there are
/// several possible counterparts, the state before is kept, and Next goes back to the latest such
/// choice (chronological backtracking). In a way that is found all joints of the piece are matched,
/// its bodies have their places, and those that are not coaxial are turned for good.
class Backtracker {
 public:
  /// Is called where the search has to go back: `joint` of `body` has no counterpart. If `tried`,
  /// one came into question, and Correspondence::failure tells what it lacks.
  using OnDeadEnd = std::function<void(int body, int joint, bool tried)>;

  /// `entry.body` must be matched. All references must outlive the search.
  Backtracker(Correspondence& matched, const Decompositions& pieces, Steps& steps,
              const Entry& entry, OnDeadEnd on_dead_end = nullptr);

  /// Goes on to the next way, whatever has been added to the correspondence since the last one.
  /// False if there is none (or the steps have run out): the correspondence is as at the start.
  bool Next();

  /// Is the present way the last one that can be found?
  [[nodiscard]] bool last() const { return choices_.empty(); }

  [[nodiscard]] const Entry& entry() const { return entry_; }

  /// The bodies of the piece but the one it was entered at, in the order of matching. Only directly
  /// after Next.
  [[nodiscard]] std::vector<int> NewBodies() const;

 private:
  /// A state of the search to which it can go back: what was matched, and how far the walk over the
  /// piece's bodies had come.
  struct Mark {
    Correspondence::Mark matched;
    size_t head;
  };
  /// What can be done next, and which of it has been tried: counterparts for `joint` or, where all
  /// joints are matched and that leaves the turn of `body` open, rotations (`joint` is -1).
  struct Choice {
    Mark mark;
    int body = -1;
    int joint = -1;
    std::vector<Counterpart> counterparts;
    std::vector<Eigen::Matrix3d> rotations;
    size_t next = 0;
    [[nodiscard]] bool exhausted() const { return next == counterparts.size() + rotations.size(); }
  };

  [[nodiscard]] std::optional<Choice> NextChoice();
  bool TryNext();
  /// Bodies of the piece as they are matched: number 0 is the entry.
  [[nodiscard]] int BodyAt(size_t index) const;
  [[nodiscard]] size_t num_bodies() const { return matched_.order().size() - first_ + 1; }
  /// What there is to match next, joints first.
  int NextJoint(int* body);
  [[nodiscard]] int NextOpenBody() const;
  [[nodiscard]] std::vector<Counterpart> CounterpartsOf(int body, int joint) const;
  void Undo(const Mark& mark);

  Correspondence& matched_;  ///< Grows and shrinks as the search goes on and back.
  const Decompositions& pieces_;
  Steps& steps_;
  Entry entry_;
  OnDeadEnd on_dead_end_;
  Correspondence::Mark start_;
  size_t first_;                 ///< Where this piece's bodies begin in the order of matching.
  size_t head_ = 0;              ///< Which body's joints are being matched, as BodyAt counts them.
  bool begun_ = false;           ///< Has Next been called?
  std::vector<Choice> choices_;  ///< Those that have something left to try, the latest last.
};

}  // namespace morphbus::congruence
