#include "tools/launch/progress.h"

#include <unistd.h>

#include <utility>

#include "tools/base/messages.h"
#include "tools/base/print.h"
#include "tools/base/work_progress.h"

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
  const double done_s = static_cast<double>(tick) * tick_s_;
  // The rate is the mean since the beginning.
  const double rate = now > 0 ? done_s / now : 0.0;
  // Without an end there is no bar.
  if (num_ticks_ <= 0) {
    ShowPassing(fmt::format("{}: {:.1f} s, {:.1f} x real time", what_, done_s, rate));
  } else {
    const double all_s = static_cast<double>(num_ticks_) * tick_s_;
    const double part = static_cast<double>(tick) / static_cast<double>(num_ticks_);
    ShowPassing(fmt::format("{} {} {:.1f} of {:.1f} s, {:.1f} x real time", what_,
                            ProgressBar(part), done_s, all_s, rate));
  }
}

void Progress::Clear() { ShowPassing(""); }

}  // namespace morphbus::tools
