#pragma once
// Brings the times of one run, B, onto those of another, A: runs in real time, under another root
// or of hardware do the same things, but not in the same ticks.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "logger/compare/kinematic_tracks.h"
#include "logger/compare/matcher.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// By what the times of two runs are matched.
enum class Align {
  kTick,   ///< Sim time itself: the runs are the same tick for tick.
  kEvent,  ///< Events of the modules: a role that is taken, a command that begins.
  kLag,    ///< One shift for the whole run: the one at which the joints move alike.
};
/// The word for it, in options and JSON: "tick", "event" or "lag".
const char* AlignName(Align align);

/// A command that begins: a joint is told something else than before.
struct CommandStart {
  /// Sim time, µs.
  int64_t time_us = 0;
  /// What it is told, under the joint's convention.
  JointCommand command;
};
/// All of one joint, in order of time; the first is what it is told at the end of the first tick in
/// which its module has a role, if that is not what it was told before. `signs` as in CommandsOf.
std::vector<CommandStart> CommandStarts(const ModuleSeries& module, int joint,
                                        const JointSigns& signs);

/// How two commands that begin differ; beyond `tolerance` they are not the same event. Commands of
/// unlike modes differ by more than any tolerance.
double CommandDifference(const JointCommand& a, const JointCommand& b);

/// Times of B on the time line of A, from events that both have: between two events the shift of
/// the earlier one holds.
class TimeMap {
 public:
  /// Adds an event that is at `b_us` in B and at `a_us` in A. Events come in order of `b_us`; one
  /// that would let time run backwards is left out.
  void Add(int64_t b_us, int64_t a_us);
  /// The time in A (µs) for one of B; the same time if there is no event.
  [[nodiscard]] int64_t ToA(int64_t b_us) const;
  /// What is added to times of B at `b_us`.
  [[nodiscard]] int64_t ShiftAt(int64_t b_us) const { return ToA(b_us) - b_us; }

 private:
  struct Anchor {
    int64_t b_us = 0;
    int64_t a_us = 0;
  };
  std::vector<Anchor> anchors_;
};

/// How B's times were brought onto A's.
struct Alignment {
  Align how = Align::kTick;
  /// True if the runs are compared at equal ticks: by choice, or because everything happens in the
  /// same ticks anyway, in lockstep and from the same root.
  bool by_ticks = true;
  /// The shift of all: what is added to B's times, µs; of shifts by event their median.
  int64_t lag_us = 0;
  /// The smallest and the largest shift of any event, µs.
  int64_t least_shift_us = 0;
  int64_t most_shift_us = 0;
  /// Events that both runs have.
  int64_t events = 0;
  /// For the modules of each of Matching::pairs, and for the robot as a whole.
  std::vector<TimeMap> of_pair;
  TimeMap of_robot;
};

/// Finds how B's times lie on A's. Both logs must have a model and a tick; `matching` is theirs.
Alignment FindAlignment(const RunLog& a, const RunLog& b, const Matching& matching, Align how);

/// B with all its times on A's time line, on A's ticks. What would come twice or too late is left
/// out.
RunLog Aligned(const RunLog& a, const RunLog& b, const Matching& matching,
               const Alignment& alignment);

/// One sentence for people.
std::string AlignmentText(const Alignment& alignment);

}  // namespace morphbus::logger
