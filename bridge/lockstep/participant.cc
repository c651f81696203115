#include "bridge/lockstep/participant.h"

#include <time.h>

#include <algorithm>

#include "bridge/bus/inproc_bus.h"

namespace morphbus::bridge {
namespace {

/// The earliest time at which a participant that is not done has something to do.
int64_t NextDeadline(const std::vector<Participant*>& participants) {
  int64_t next = kNever;
  for (const Participant* participant : participants) {
    if (!participant->done()) next = std::min(next, participant->next_deadline_us());
  }
  return next;
}

/// Whether the run is over for everybody.
bool AllDone(const std::vector<Participant*>& participants) {
  return std::all_of(participants.begin(), participants.end(),
                     [](const Participant* p) { return p->done(); });
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
  // Slept in small steps, so that a signal is noticed soon.
  const int64_t wait_us = std::clamp<int64_t>(us - NowUs(), 0, 500'000);
  const timespec wait = {0, wait_us * 1000};
  nanosleep(&wait, nullptr);
}

void RunParticipants(Bus* bus, const TimeSource& time,
                     const std::vector<Participant*>& participants, const volatile bool* stop,
                     const std::function<void()>& each_second) {
  constexpr int64_t kSecond = 1'000'000;
  const auto report = [&] {
    if (each_second) each_second();
  };
  int64_t report_us = time.NowUs() + kSecond;
  for (Participant* participant : participants) participant->Start();
  while (!AllDone(participants) && !Stopped(stop)) {
    // Sleep on the bus until a message comes or something is due.
    const int64_t due = std::min(NextDeadline(participants), report_us) - time.NowUs();
    bus->HandleFor(std::clamp<int64_t>(due, 0, kSecond));
    for (Participant* participant : participants) participant->OnTime();
    if (time.NowUs() < report_us) continue;
    report_us = time.NowUs() + kSecond;
    report();
  }
  report();
}

bool RunInproc(InprocHub* hub, VirtualTime* time, const std::vector<Participant*>& participants,
               const volatile bool* stop) {
  for (Participant* participant : participants) participant->Start();
  return ContinueInproc(hub, time, participants, stop);
}

bool ContinueInproc(InprocHub* hub, VirtualTime* time,
                    const std::vector<Participant*>& participants, const volatile bool* stop) {
  // Without loss the hub never falls silent: participants that watch the wall clock want their turn
  // too.
  constexpr int kRoundsBetween = 64;
  int rounds = 0;
  while (!AllDone(participants)) {
    if (Stopped(stop)) return false;
    // Messages first; time passes only when none is under way.
    const bool idle = hub->HandleRound() == 0;
    if (!idle && ++rounds % kRoundsBetween != 0) continue;
    if (idle) {
      const int64_t next = NextDeadline(participants);
      // Nothing is under way and nothing will become due: the run cannot go on.
      if (next == kNever) return false;
      time->AdvanceTo(next);
    }
    for (Participant* participant : participants) participant->OnTime();
  }
  // Once more, so that every ledger tells what was lost up to the end.
  for (Participant* participant : participants) participant->OnTime();
  return true;
}

}  // namespace morphbus::bridge
