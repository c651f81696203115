#pragma once
// The cycle of a gait: the shortest time after which what all joints are told comes again.
//
// The method is that of pitch detection in speech, for several signals at once. For every lag the
// mean squared difference between the signals and themselves so much later is divided by their
// variance (the normalised difference function of A. de Cheveigné and H. Kawahara, "YIN, a
// fundamental frequency estimator for speech and music", JASA 111(4), 2002, Sec. II.B to II.E). Of
// the lags whose difference is below a threshold the smallest is taken that explains about as much
// of the run as the best does, so that a multiple of the period is not; a parabola through the
// difference at the neighbouring lags, and then at multiples of the period, gives it to a small
// part of a tick (ibid., Sec. II.E).
//
// Three things differ, since these are commands and no sound. The difference is taken over windows
// of one period instead of the whole run, and the longest row of windows that repeat is what
// counts: getting up, and halting, are no part of a gait. Every signal must repeat by itself, since
// a small joint with twice the period makes the period twice as long. And a value is compared with
// all that the signal has within a tick or two of the lag, give or take a tolerance: a behaviour
// acts on ticks, so that steps with a period of 18.5 ticks come after 18 ticks and after 19, and
// programs round angles to whole degrees.

#include <optional>
#include <string>
#include <vector>

namespace morphbus::logger {

/// What one joint is told, or where it is: a value for each tick (rad, m, or per second).
struct Signal {
  std::vector<double> values;
  /// Values that differ by no more are one; what moves no more than twice as far is still.
  double tolerance = 0.0;
};

/// A cycle that was found. Times are ticks from the signals' first one, and parts of ticks.
struct FoundCycle {
  /// When each whole cycle begins, and behind them the end of the last: at least three times. They
  /// are as far apart as the commands are; where those come when something has arrived, or in real
  /// time, that is not always the same.
  std::vector<double> begins;
  /// The period, over as many cycles as there are.
  double period = 0.0;
};

/// What came of a search: a cycle, or why there is none, as a clause ("the commands do not
/// change").
struct CycleSearch {
  std::optional<FoundCycle> cycle;
  std::string why_not;
};

/// How the search is done.
struct CycleOptions {
  /// Length of a tick, s; for the words of `why_not`.
  double tick_s = 0.02;
  /// By how many ticks a repetition may be early or late at most. Short cycles allow less: a 25th
  /// of the lag, and one tick at least.
  int slack_ticks = 2;
};

/// Finds the cycle of signals of one length. It must come twice as a whole, and over a third of the
/// time in which anything changes.
CycleSearch FindCycle(const std::vector<Signal>& signals, const CycleOptions& options);

/// How badly signals repeat after `period` ticks between the ticks `begin` and `end`: the squared
/// difference beyond slack and tolerance, as a part of the variance; 0 if exactly, some 2 if not at
/// all. None if nothing moves there.
std::optional<double> Mismatch(const std::vector<Signal>& signals, double period, int begin,
                               int end, int slack_ticks);

}  // namespace morphbus::logger
