#pragma once
// When a run of several processes has failed, and why.

#include <deque>
#include <map>
#include <optional>
#include <string>

#include "bridge/lockstep/participant.h"
#include "tools/machine/wall_clock.h"

namespace morphbus::tools {

/// The exits of one process: three of them within ten seconds are too many, for starting it again
/// is no help then.
class ExitLimit {
 public:
  static constexpr int kMostExits = 3;
  static constexpr double kSeconds = 10;

  /// Notes an exit; `now_s` never falls from one call to the next. True if it was one too many.
  bool TooMany(double now_s) {
    exits_.push_back(now_s);
    while (exits_.front() <= now_s - kSeconds) exits_.pop_front();
    return exits_.size() >= kMostExits;
  }

 private:
  /// Times of the exits in the last ten seconds, oldest first.
  std::deque<double> exits_;
};

/// Decides whether a run has failed, by what the launcher sees and hears of its processes: who has
/// ended and how, who has spoken, what time it is. It starts and ends nothing, and reads no clock
/// but the one that it is given, so that tests know how soon a run is over after what befell it.
/// The first failure stays; others mostly follow from it.
class FailureWatch {
 public:
  // The names of two processes in messages; all others are modules'.
  static constexpr const char* kSim = "sim";
  static constexpr const char* kLog = "log";
  /// In which the sim may tell more of what the logger has told, seconds like those below.
  static constexpr double kToldSeconds = 0.5;
  /// In which the sim must end the run that somebody has left.
  static constexpr double kLeftSeconds = 2.0;
  /// Of silence of the simulator; after 10 s modules would give up.
  static constexpr double kSilentSeconds = 8.0;
  /// In which a run must be over once it was told to stop.
  static constexpr double kStopSeconds = 10.0;

  /// @param time  outlives this; null: the machine's monotonic clock.
  explicit FailureWatch(const bridge::TimeSource* time = nullptr);

  /// The sim has said something, whatever it is.
  void SimSpoke() { since_sim_spoke_.emplace(time_); }
  /// The sim has said that the run is over, and what went wrong (empty: nothing). It knows best:
  /// its word takes the place of what was found before.
  void SimReported(const std::string& wrong);
  [[nodiscard]] bool sim_reported() const { return sim_reported_; }
  /// The logger has closed its log. `wrong` says what is wrong with that; empty if nothing is.
  void LogClosed(const std::string& wrong);
  [[nodiscard]] bool log_closed() const { return log_closed_; }
  /// The run was told to stop.
  void Interrupted();

  /// A process has ended that was not told to.
  /// @param name    as messages call it; each of the run has one of its own.
  /// @param status  of its exit, or 128 and the signal.
  /// @param how     what became of it: "was killed by signal 9 (Killed)".
  /// @return whether it shall be started again.
  bool OnExit(const std::string& name, int status, const std::string& how);
  /// Looks at the clock; to be called at least twice a second, since only time in which the caller
  /// ran counts.
  void OnTime();
  /// Notes a failure that somebody else has found.
  void Fail(const std::string& error);
  /// Why the run has failed; empty while it has not.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  const bridge::TimeSource* time_;
  bool sim_reported_ = false, log_closed_ = false;
  std::string log_wrong_;  ///< What is wrong with the closed log.
  /// By process of modules: its exits.
  std::map<std::string, ExitLimit> exits_;
  std::string first_left_;  ///< Who ended, without an error, before the sim's report.
  // Since that, since the run was told to stop, and since the sim's last word: building a robot
  // takes time, so that this begins with its first.
  std::optional<WakingTimer> since_left_, since_interrupted_, since_sim_spoke_;
  std::string error_;
};

}  // namespace morphbus::tools
