#include "bridge/party.h"

#include <time.h>

#include <algorithm>

#include "bridge/inproc_bus.h"

namespace morphbus::bridge {
namespace {

int64_t NextDeadline(const std::vector<Party*>& parties) {
  int64_t next = kNever;
  for (const Party* party : parties) {
    if (!party->done()) next = std::min(next, party->next_deadline_us());
  }
  return next;
}

bool AllDone(const std::vector<Party*>& parties) {
  return std::all_of(parties.begin(), parties.end(), [](const Party* p) { return p->done(); });
}

bool Stopped(const volatile bool* stop) { return stop != nullptr && *stop; }

}  // namespace

int64_t MonotonicTime::NowUs() const {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
}

int64_t SleepingTime::NowUs() const { return MonotonicTime().NowUs(); }

void SleepingTime::AdvanceTo(int64_t us) {
  const int64_t wait_us = std::clamp<int64_t>(us - NowUs(), 0, 500'000);
  const timespec wait = {0, wait_us * 1000};
  nanosleep(&wait, nullptr);
}

void RunParties(Bus* bus, const TimeSource& time, const std::vector<Party*>& parties,
                const volatile bool* stop, const std::function<void()>& each_second) {
  constexpr int64_t kSecond = 1'000'000;
  const auto report = [&] {
    if (each_second) each_second();
  };
  int64_t report_us = time.NowUs() + kSecond;
  for (Party* party : parties) party->Start();
  while (!AllDone(parties) && !Stopped(stop)) {
    const int64_t due = std::min(NextDeadline(parties), report_us) - time.NowUs();
    // Rounded up: waking a moment before the deadline would only spin.
    const int timeout_ms = static_cast<int>(std::clamp<int64_t>((due + 999) / 1000, 0, 1000));
    bus->Handle(timeout_ms);
    for (Party* party : parties) party->OnTime();
    if (time.NowUs() < report_us) continue;
    report_us = time.NowUs() + kSecond;
    report();
  }
  report();
}

bool RunInproc(InprocHub* hub, VirtualTime* time, const std::vector<Party*>& parties,
               const volatile bool* stop) {
  // Without loss the hub never falls silent: parties that watch the wall clock want their turn too.
  constexpr int kRoundsBetween = 64;
  for (Party* party : parties) party->Start();
  int rounds = 0;
  while (!AllDone(parties)) {
    if (Stopped(stop)) return false;
    const bool idle = hub->HandleRound() == 0;
    if (!idle && ++rounds % kRoundsBetween != 0) continue;
    if (idle) {
      const int64_t next = NextDeadline(parties);
      if (next == kNever) return false;
      time->AdvanceTo(next);
    }
    for (Party* party : parties) party->OnTime();
  }
  return true;
}

}  // namespace morphbus::bridge
