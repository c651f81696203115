#include "tools/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "tools/cli.h"

namespace morphbus::tools {

Progress::Progress(std::string what, int64_t num_ticks, uint32_t tick_us)
    : what_(std::move(what)),
      num_ticks_(num_ticks),
      tick_s_(tick_us * 1e-6),
      enabled_(IsFancyTerminal(STDERR_FILENO)) {}

void Progress::Show(int64_t tick) {
  const double now = timer_.seconds();
  if (!enabled_ || now < next_s_) return;
  next_s_ = now + 0.1;
  drawn_ = true;
  const double done_s = static_cast<double>(tick) * tick_s_;
  const double rate = now > 0 ? done_s / now : 0.0;
  if (num_ticks_ <= 0) {
    fmt::print(stderr, "\r\033[K{}: {:.1f} s, {:.1f} x real time", what_, done_s, rate);
  } else {
    constexpr int kWidth = 30;
    const double part =
        std::clamp(static_cast<double>(tick) / static_cast<double>(num_ticks_), 0.0, 1.0);
    const int full = static_cast<int>(part * kWidth);
    fmt::print(stderr, "\r\033[K{} [{:#<{}}{:.<{}}] {:.1f} of {:.1f} s, {:.1f} x real time", what_,
               "", full, "", kWidth - full, done_s, static_cast<double>(num_ticks_) * tick_s_,
               rate);
  }
  std::fflush(stderr);
}

void Progress::Clear() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace morphbus::tools
