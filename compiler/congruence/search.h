#pragma once
// Backtracking search for the ways to match one assembly with another. Internal to
// compiler/congruence. A search for isomorphisms of labelled graphs, such as VF2, cannot take its
// place: of many like modules nearly all isomorphisms are no mappings (docs/libraries.md).

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "compiler/congruence/correspondence.h"
#include "compiler/congruence/plan.h"

namespace morphbus::congruence {

/// A budget of joints to try, shared by all searches that serve one question. With it the time of
/// any answer is bounded.
struct Steps {
  int64_t left = 0;  ///< How many may still be tried.
  [[nodiscard]] bool gave_up() const { return left <= 0; }
};

/// Matches the joints of a one by one, in the order of a plan, each with one that class, place and
/// direction allow; Correspondence works out what follows for the body at its other end. Where
/// there are several possible counterparts, the search can go back to the latest such choice
/// (chronological backtracking).
///
/// Once an independent part (see Plan) is matched, the choices made in it are dropped: other ways
/// to match it would not help the rest. That holds for the choice with which the part began too, as
/// "can be matched with" parts pieces and images into classes (if X fits Z and Y fits Z, then X
/// fits whatever Y fits), so that among pieces that look alike each can take the first that it
/// fits. Where the turn of the body that it shares was open before, and the part settled it, the
/// choices that led to that stay.
class Search {
 public:
  /// Is called where the search has to go back: `joint` of `body` has no counterpart. If `tried`,
  /// one came into question, and `matched.failure()` tells what it lacks.
  using OnDeadEnd =
      std::function<void(const Correspondence& matched, int body, int joint, bool tried)>;

  /// `a`, `b` and `steps` must outlive the search.
  Search(const ScrewGraph& a, const ScrewGraph& b, const Classes& classes, Plan plan, Steps& steps,
         OnDeadEnd on_dead_end = nullptr);

  [[nodiscard]] Correspondence& matched() { return matched_; }
  [[nodiscard]] const Plan& plan() const { return plan_; }
  [[nodiscard]] int num_steps() const { return static_cast<int>(plan_.steps.size()); }
  /// The bodies of b in the class of the seed.
  [[nodiscard]] std::vector<int> Images() const;

  /// Forgets everything but failures, and matches the seed with `image`. How it is turned is for
  /// its joints to say; a body without joints keeps its orientation.
  void Begin(int image);
  /// Carries out the steps from number `from` up to `end`, those before having been carried out.
  /// False if that cannot be done, or the budget has run out; what is matched then is undefined.
  bool Match(int from, int end);
  /// All steps, after Begin.
  bool MatchAll() { return Match(0, num_steps()); }
  /// Goes on from the end of Match to another way to match the same steps.
  bool Next();

  // For a caller that takes the steps by hand:

  /// What the joint of the next step may be matched with, as far as can be seen at once: those of
  /// the modules first by name come first.
  const std::vector<JointImage>& Prepare(int step);
  /// Matches that joint with the counterpart. False if it does not fit; something may have changed.
  bool Take(int step, const JointImage& counterpart);
  /// The number of steps done when all is matched that a choice at `step` can affect.
  [[nodiscard]] int EndOfEffect(int step) const;

 private:
  /// A step that is being carried out, or has been.
  struct Frame {
    Correspondence::Mark before;
    std::vector<JointImage> counterparts;
    size_t next = 0;  ///< The counterpart to try next.
    /// PartialRotations::freedom of the step's body before the step and directly after it.
    int freedom_before = 0;
    int freedom_after = 0;
  };
  /// What can be remembered of a part: its first step, the image of its body, and the counterpart
  /// of the first joint, by its index and sign.
  using PartKey = std::array<int, 4>;

  [[nodiscard]] int FreedomAt(int step) const;
  bool TryCounterparts(int step);
  bool GoOn(int step);
  bool GoBack(int& step);
  void DropChoices(int done);
  [[nodiscard]] PartKey KeyOf(int step) const;
  [[nodiscard]] bool KnownToFail(int step) const;
  void RememberFailure(int from, int failed);

  Correspondence matched_;
  Plan plan_;
  Steps& steps_;
  OnDeadEnd on_dead_end_;
  std::vector<std::vector<int>> joints_b_;  ///< By body of b: its joints by names of modules.
  std::vector<Frame> frames_;               ///< By step.
  /// Steps with several counterparts, the latest last; also one of which all have been tried, so
  /// that the failure of the last is remembered too.
  std::vector<int> choices_;
  int end_ = 0;  ///< Of the present Match.
  /// The rotations of the body with which a part was found to have no match.
  std::map<PartKey, std::vector<Eigen::Matrix3d>> failed_;
};

}  // namespace morphbus::congruence
