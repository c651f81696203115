#include "tools/base/work_progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "logger/log/event_log.h"
#include "tools/base/messages.h"
#include "tools/base/print.h"

namespace morphbus::tools {

std::string ProgressBar(double part) {
  constexpr int kWidth = 30;
  // As many # as are done, dots for the rest.
  const int full = static_cast<int>(std::clamp(part, 0.0, 1.0) * kWidth);
  return fmt::format("[{:#<{}}{:.<{}}]", "", full, "", kWidth - full);
}

WorkProgress::WorkProgress() : enabled_(IsFancyTerminal(STDERR_FILENO)) {
  if (!enabled_) return;
  logger::WatchReading([this](const std::string& path, double part) { Show(path, part); });
}

WorkProgress::~WorkProgress() {
  if (!enabled_) return;
  logger::WatchReading(nullptr);
  ShowPassing("");
}

void WorkProgress::Show(const std::string& what, double part) {
  const auto now = std::chrono::steady_clock::now();
  if (!enabled_ || now < next_) return;
  // A terminal that is slow, over a network say, must not slow the work.
  next_ = now + std::chrono::milliseconds(100);
  ShowPassing(fmt::format("{} {} {:.0f} %", what, ProgressBar(part), part * 100));
}

}  // namespace morphbus::tools
