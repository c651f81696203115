#include "tools/launch/progress.h"

#include <unistd.h>

#include <algorithm>
#include <utility>

#include "tools/base/messages.h"
#include "tools/base/print.h"

namespace morphbus::tools {

Progress::Progress(std::string what, int64_t num_ticks, uint32_t tick_us)
    : what_(std::move(what)),
      num_ticks_(num_ticks),
      tick_s_(tick_us * 1e-6),
      enabled_(IsFancyTerminal(STDERR_FILENO)) {}

void Progress::Show(int64_t tick) {
  const double now = timer_.seconds();
  if (!enabled_ || now < next_s_) return;
  // A terminal that is slow, over a network say, must not slow the run.
  next_s_ = now + 0.1;
  drawn_ = true;
  const double done_s = static_cast<double>(tick) * tick_s_;
  // The rate is the mean since the beginning.
  const double rate = now > 0 ? done_s / now : 0.0;
  // Without an end there is no bar.
  if (num_ticks_ <= 0) {
    // \r goes to the beginning of the line, and \033[K clears it.
    Say("\r\033[K{}: {:.1f} s, {:.1f} x real time", what_, done_s, rate);
  } else {
    // As many # as are done, dots for the rest.
    constexpr int kWidth = 30;
    const double part =
        std::clamp(static_cast<double>(tick) / static_cast<double>(num_ticks_), 0.0, 1.0);
    const int full = static_cast<int>(part * kWidth);
    Say("\r\033[K{} [{:#<{}}{:.<{}}] {:.1f} of {:.1f} s, {:.1f} x real time", what_, "", full, "",
        kWidth - full, done_s, static_cast<double>(num_ticks_) * tick_s_, rate);
  }
}

void Progress::Clear() {
  if (drawn_) Say("\r\033[K");
  drawn_ = false;
}

}  // namespace morphbus::tools
