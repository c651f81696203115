#pragma once
// Goes through all mappings one by one, and notes where the most promising attempt ended if there
// are none. Internal to compiler/congruence.

#include <functional>
#include <optional>
#include <unordered_set>
#include <vector>

#include "compiler/congruence/backtracker.h"

namespace morphbus::congruence {

/// A point from which an attempt to match two assemblies did not go on.
struct DeadEnd {
  /// How much the attempt says to a person: the number of bodies matched, twice that if all went to
  /// their namesakes, as in a copy that was changed in one place.
  int promise = 0;
  /// The joint of a that has no counterpart, and the body that its counterpart was looked for from.
  int body = -1;
  int joint = -1;
  /// Did a counterpart come into question? Then Correspondence::failure says what it lacks.
  bool tried = false;
  /// What was matched by then, `body` too. Absent if no body of b has a joint like this one.
  std::optional<Correspondence> matched;
};

/// Searches both assemblies as wholes, over all joints from a seed body and each of its possible
/// images. Unlike MappingBuilder this comes to every mapping, and ends at single
/// joints that a person can look up; but where much is alike it may not end in reasonable time, so
/// it is for robots with few mappings and for explanations.
class MappingSearch {
 public:
  /// At most `max_steps` joints are tried. `a` and `b` must outlive the search.
  MappingSearch(const ScrewGraph& a, const ScrewGraph& b, Classes classes, int64_t max_steps);

  /// Calls `found` for each mapping, none twice, until it returns false.
  void Run(const std::function<bool(const Mapping&)>& found);

  /// Did Run end because the steps ran out?
  [[nodiscard]] bool gave_up() const { return steps_.gave_up(); }

  /// The most promising of the attempts that failed, by DeadEnd::promise; the first of several.
  [[nodiscard]] const std::optional<DeadEnd>& dead_end() const { return dead_end_; }

 private:
  /// Keeps the present state if it is the most promising dead end so far.
  void NoteDeadEnd(int body, int joint, bool tried);
  /// False for a mapping that was found before.
  bool IsNew(const Mapping& mapping);

  const ScrewGraph& a_;
  const ScrewGraph& b_;
  Correspondence matched_;
  Decompositions whole_;  ///< Either assembly as one piece.
  Steps steps_;
  std::vector<int> namesakes_;  ///< By body of a: that of b with its first link's namesake, or -1.
  std::optional<DeadEnd> dead_end_;
  std::unordered_set<uint64_t> seen_;  ///< Hashes of the mappings found.
};

}  // namespace morphbus::congruence
