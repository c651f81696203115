#include "bridge/wire/health.h"

#include <sys/resource.h>
#include <time.h>

namespace morphbus::bridge {
namespace {

/// A time of getrusage as one number.
int64_t Microseconds(const timeval& time) {
  return int64_t{time.tv_sec} * 1'000'000 + time.tv_usec;
}

}  // namespace

morphbus::health_t MakeHealth(const std::string& process, const Ledger& ledger) {
  morphbus::health_t health;
  health.process = process;
  // Wall clock: HEALTH is not in the run's hash.
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  health.wall_time_us = int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
  // The ledger's fields are explained in bridge/bus/bus.h and in health_t.lcm.
  health.received = ledger.received;
  health.sent = ledger.sent;
  health.lost = ledger.lost;
  health.discarded = ledger.discarded;
  health.duplicates = ledger.duplicates;
  health.resent = ledger.resent;
  health.asked = ledger.asked;
  health.queue_overflows = ledger.queue_overflows;
  health.bad = ledger.bad;
  health.missed_deadlines = ledger.missed_deadlines;
  // What the process has used since it began.
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  health.max_rss_kb = usage.ru_maxrss;
  health.cpu_us = Microseconds(usage.ru_utime) + Microseconds(usage.ru_stime);
  return health;
}

}  // namespace morphbus::bridge
