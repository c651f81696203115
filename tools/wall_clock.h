#pragma once
// Wall time for people and time limits; never in a payload.

#include <chrono>

namespace morphbus::tools {

class WallTimer {
 public:
  /// Seconds since construction.
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace morphbus::tools
