#include "tools/launch/failure_watch.h"

#include <fmt/format.h>

#include "tools/base/messages.h"

namespace morphbus::tools {

FailureWatch::FailureWatch(const bridge::TimeSource* time) : time_(time) {}

void FailureWatch::SimReported(const std::string& wrong) {
  // The sim's report is the last word: a failure before it may only have followed from what it
  // tells.
  sim_reported_ = true;
  if (!wrong.empty()) error_ = wrong;
}

void FailureWatch::LogClosed(const std::string& wrong) {
  // What the logger found wrong counts only if the sim, which knows more of the run, does not tell.
  log_closed_ = true;
  log_wrong_ = wrong;
}

void FailureWatch::Interrupted() {
  // A second interrupt gives no further time.
  if (!since_interrupted_) since_interrupted_.emplace(time_);
}

bool FailureWatch::OnExit(const std::string& name, int status, const std::string& how) {
  const std::string what = name + " " + how;
  // Once the run is over all end, and without an error.
  if (sim_reported_) {
    if (status != 0) Fail(what + " at the end of the run");
    return false;
  }
  // Ending without an error may be right: the end of the run may have reached this process first,
  // and the simulator's own report may be a moment behind its farewell to the others.
  if (status == 0 || (name == kLog && log_closed_)) {
    if (!first_left_.empty()) return false;
    first_left_ = name;
    since_left_.emplace(time_);
    return false;
  }
  // Only modules go on where they were, unless what they were given is of no use.
  if (name == kSim || name == kLog || status == kUnusable) {
    Fail(what);
    return false;
  }
  // A process that dies again and again would be started for ever.
  const int64_t now_us = time_ != nullptr ? time_->NowUs() : bridge::MonotonicTime().NowUs();
  if (exits_[name].TooMany(static_cast<double>(now_us) * 1e-6)) {
    Fail(fmt::format("{}, the third exit within {:.0f} s", what, ExitLimit::kSeconds));
  }
  return error_.empty();
}

void FailureWatch::OnTime() {
  // The three things that take too long: stopping, silence, and the report. Each timer is asked in
  // every round, since it counts the time in which this process ran.
  const auto seconds = [](std::optional<WakingTimer>* timer) {
    return *timer ? (*timer)->seconds() : 0;
  };
  const double stopping = seconds(&since_interrupted_);
  const double silent = seconds(&since_sim_spoke_);
  const double left = seconds(&since_left_);
  if (stopping > kStopSeconds) Fail("the run did not stop when told to");
  if (!sim_reported_ && silent > kSilentSeconds) {
    Fail(fmt::format("{} has been silent for {:.0f} s", kSim, kSilentSeconds));
  }
  // A logger that says what was wrong with the run is believed sooner.
  const bool told = first_left_ == kLog && !log_wrong_.empty();
  if (!sim_reported_ && left > (told ? kToldSeconds : kLeftSeconds)) {
    Fail(first_left_ + " left the run before its end" + (told ? ": " + log_wrong_ : ""));
  }
}

void FailureWatch::Fail(const std::string& error) {
  // The first failure is the cause; those behind it mostly follow.
  if (error_.empty()) error_ = error;
}

}  // namespace morphbus::tools
