#pragma once
// Congruences one by one, and why there is none. Internal to compiler/congruence.

#include <functional>
#include <optional>
#include <unordered_set>
#include <vector>

#include "compiler/congruence/assembly.h"
#include "compiler/congruence/classes.h"
#include "compiler/congruence/congruence.h"
#include "compiler/congruence/correspondence.h"

namespace morphbus::congruence {

/// Where the most promising attempt got stuck, as it stood then.
struct Stuck {
  int promise = 0;     ///< The number of bodies matched, twice that if all went to their namesakes.
  int bodies = 0;      ///< Matched so far.
  int body = -1;       ///< Of a, matched with `image`, ...
  int image = -1;      ///< -1: no body of b is like it.
  int joint = -1;      ///< ... whose joint has no counterpart.
  bool first = false;  ///< No joint is matched yet, so R is as this one asks.
  bool settled = false;  ///< Is R known wholly?
  Eigen::Matrix3d R;
  std::vector<bool> taken;     ///< Joints of b that have their counterpart already.
  std::vector<int> body_to;    ///< Bodies matched so far; -1 for the others.
  std::vector<bool> occupied;  ///< Bodies of b that are counterparts.
  /// What the counterpart that was tried last lacks; absent if none came into question.
  std::optional<Failure> failure;
};

/// Lists congruences one by one. Grows a correspondence from one pair of seed bodies over the
/// joints; where several could be meant, or more mappings are wanted, it comes back and tries the
/// others.
class Search {
 public:
  Search(const Assembly& a, const Assembly& b, Classes classes, int64_t max_steps);

  /// Calls `found` for each mapping, until it returns false.
  void Run(const std::function<bool(const Mapping&)>& found);

  [[nodiscard]] bool gave_up() const { return steps_ >= max_steps_; }
  [[nodiscard]] const std::optional<Stuck>& stuck() const { return stuck_; }

 private:
  struct Mark {
    Correspondence::Mark matched;
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
  void NoteStuck(int body, int joint, bool failed);
  void Report();
  [[nodiscard]] Mark mark() const { return {matched_.mark(), head_, slot_}; }
  void Undo(const Mark& mark);

  const Assembly& a_;
  const Assembly& b_;
  Correspondence matched_;
  int64_t max_steps_;
  int64_t steps_ = 0;
  std::vector<int> namesakes_;  ///< [body of a] -> body of b with the first link's namesake, or -1.
  size_t head_ = 0;             ///< Body whose joints are looked at, in the order of matching.
  size_t slot_ = 0;             ///< Which of its joints.
  std::vector<Choice> choices_;
  std::optional<Stuck> stuck_;
  std::unordered_set<uint64_t> seen_;  ///< Hashes of mappings, so that none counts twice.
  const std::function<bool(const Mapping&)>* found_ = nullptr;
  bool stopped_ = false;
};

}  // namespace morphbus::congruence
