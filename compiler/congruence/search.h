#pragma once
// The search for congruences. Internal to compiler/congruence.

#include <functional>
#include <optional>
#include <unordered_set>
#include <vector>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/classes.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/partial_rotations.h"

namespace morphbus::congruence {

/// Where the most promising attempt got stuck, as it stood then.
struct Stuck {
  int promise = 0;  ///< The number of bodies matched, twice that if all went to their namesakes.
  int bodies = 0;   ///< Matched so far.
  int body = -1;    ///< Of a, matched with `image`, ...
  int image = -1;
  int joint = -1;        ///< ... whose joint has no counterpart.
  bool settled = false;  ///< Is R known wholly?
  Eigen::Matrix3d R;
  std::vector<bool> taken;  ///< Joints of b that have their counterpart already.
};

/// The offset that maps `joint`'s limits onto those of `to`, for a joint that has limits.
double OffsetOfLimits(const AssemblyJoint& joint, const AssemblyJoint& to, double sign);

/// Are they of one kind, and their ranges equally wide? `slide_tolerance` in m.
bool SameRange(const AssemblyJoint& joint, const AssemblyJoint& to, double slide_tolerance);

/// Grows a correspondence from one pair of seed bodies over the joints, each of which must have its
/// screw axis where its counterpart has it, relative to the body; where several could be meant, or
/// more mappings are wanted, it comes back and tries the others.
class Search {
 public:
  Search(const Assembly& a, const Assembly& b, Classes classes, int64_t max_steps);

  /// Calls `found` for each mapping, until it returns false.
  void Run(const std::function<bool(const Mapping&)>& found);

  [[nodiscard]] bool gave_up() const { return steps_ >= max_steps_; }
  [[nodiscard]] const std::optional<Stuck>& stuck() const { return stuck_; }

 private:
  struct Option {
    int to;
    double sign;
  };
  struct Mark {
    size_t bodies;
    size_t joints;
    PartialRotations::Mark rotations;
    size_t head;
    size_t slot;
  };
  /// A joint with several possible counterparts.
  struct Choice {
    Mark mark;
    int body;
    int joint;
    std::vector<Option> options;
    size_t next = 0;
  };

  [[nodiscard]] int SeedBody() const;
  [[nodiscard]] int SeedJoint(int seed) const;
  void TrySeed(int seed, int image, int joint, const Option& option);
  void Grow();
  bool TakeNext();
  [[nodiscard]] int NextJoint();
  [[nodiscard]] std::vector<Option> OptionsFor(int body, int joint) const;
  [[nodiscard]] bool Plausible(int body, int joint, const Option& option) const;
  bool Commit(int body, int joint, const Option& option);
  bool CommitTurn(int body, int joint, const Option& option);
  bool CommitSlide(int body, int joint, const Option& option);
  void PlaceSeed(int seed, int image, int joint, const Option& option);
  bool PlaceOther(int body, int joint, const Option& option);
  void MatchBodies(int body, int image);
  void NoteStuck(int body, int joint);
  void Report();
  void SettleTheRest();
  [[nodiscard]] double FinalOffset(int joint, const Option& option) const;
  [[nodiscard]] bool KeepsFrame() const;
  [[nodiscard]] std::vector<int> ModuleMap() const;
  [[nodiscard]] Mark mark() const;
  void Undo(const Mark& mark);

  const Assembly& a_;
  const Assembly& b_;
  Classes classes_;
  int64_t max_steps_;
  int64_t steps_ = 0;
  double length_tolerance_;
  double slide_tolerance_;
  PartialRotations R_;
  std::vector<int> body_to_, body_from_;
  std::vector<Option> joint_to_;  ///< .to -1: none yet.
  std::vector<int> joint_from_;
  std::vector<int> order_;         ///< Bodies of a, as they were matched.
  std::vector<int> joints_order_;  ///< Joints of a, as they were matched.
  size_t head_ = 0;                ///< Body whose joints are looked at, in order_.
  size_t slot_ = 0;                ///< Which of its joints.
  std::vector<Choice> choices_;
  std::optional<Stuck> stuck_;
  std::unordered_set<uint64_t> seen_;  ///< Hashes of mappings, so that none counts twice.
  const std::function<bool(const Mapping&)>* found_ = nullptr;
  bool stopped_ = false;
};

}  // namespace morphbus::congruence
