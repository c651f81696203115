#pragma once
// How often a process may die before starting it again is no help.

#include <deque>

namespace morphbus::tools {

/// The exits of one process: three of them within ten seconds are too many.
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

}  // namespace morphbus::tools
