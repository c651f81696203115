#pragma once
// Why two assemblies are not congruent, so that a person can check it.

#include <optional>
#include <string>
#include <vector>

#include "compiler/congruence/correspondence.h"

namespace morphbus::congruence {

/// A difference that counting shows: numbers of bodies and joints, joints of some kind and range,
/// bodies with so many joints. Empty if the counts agree.
std::string DifferentCounts(const ScrewGraph& a, const ScrewGraph& b);

/// A point from which an attempt to match two assemblies did not go on.
struct DeadEnd {
  /// What was matched by then.
  Correspondence matched;
  /// The joint of a that has no counterpart, and the body that its counterpart was looked for from.
  int body = -1;
  int joint = -1;
  /// Did a counterpart come into question? Then Correspondence::failure says what it lacks.
  bool tried = false;
  /// How much the attempt says to a person: the number of bodies matched, twice that if all went to
  /// their namesakes, as in a copy that was changed in one place.
  int promise = 0;
};

/// Keeps the most promising of the attempts that failed; the first of several.
class DeadEnds {
 public:
  DeadEnds(const ScrewGraph& a, const ScrewGraph& b);

  /// Takes note of an attempt that ended, as Search tells of it.
  void Note(const Correspondence& matched, int body, int joint, bool tried);

  /// The joint at which the attempt ended, the pair of bodies from which its counterpart was looked
  /// for, and what is there instead: where the joint would have to be and how far the nearest one
  /// is off or, where one is in place, what that one lacks. If all attempts ended at once, this
  /// speaks of the first joint of `seed`, with which they began.
  [[nodiscard]] std::string Explain(int seed) const;

 private:
  const ScrewGraph& a_;
  const ScrewGraph& b_;
  std::vector<int> namesakes_;  ///< By body of a: that of b with its first link's namesake, or -1.
  std::optional<DeadEnd> best_;
};

}  // namespace morphbus::congruence
