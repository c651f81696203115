#pragma once
// How far a command has come that works through a log or makes many pictures: a line on stderr, on
// terminals only.

#include <chrono>
#include <string>

namespace morphbus::tools {

/// "[#####.....]" for the part, 0…1, that is done.
std::string ProgressBar(double part);

/// While it lives, every log that is read shows how much of it has been read (WatchReading). What a
/// command prints takes the line away by itself.
class WorkProgress {
 public:
  WorkProgress();
  WorkProgress(const WorkProgress&) = delete;
  WorkProgress& operator=(const WorkProgress&) = delete;
  /// Takes the line away.
  ~WorkProgress();

  /// Shows that `part` (0…1) of `what` is done. Draws at most ten times a second, however often it
  /// is called, and nothing where stderr is no terminal.
  void Show(const std::string& what, double part);

 private:
  /// Whether stderr is a terminal that can redraw a line.
  bool enabled_;
  /// When the line may be drawn again.
  std::chrono::steady_clock::time_point next_;
};

}  // namespace morphbus::tools
