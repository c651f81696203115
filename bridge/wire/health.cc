#include "bridge/wire/health.h"

#include <sys/resource.h>
#include <time.h>

#include <tuple>

#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/wire_size.h"

namespace morphbus::bridge {

static_assert(SizeWithoutArrays<morphbus::health_t>() +
                      kMostLateness * LargestSize<morphbus::lateness_t>() +
                      kMostTopicTotals * LargestSize<morphbus::topic_total_t>() +
                      kMostUnauthenticChannels * LargestSize<morphbus::channel_count_t>() <=
                  kMaxPayloadBytes,
              "HEALTH must fit into a datagram");

namespace {

/// A time of getrusage as one number.
int64_t Microseconds(const timeval& time) {
  return int64_t{time.tv_sec} * 1'000'000 + time.tv_usec;
}

}  // namespace

std::string FirstRefused(const Ledger& ledger) {
  // Both are told, since what came without the key and what was refused have unlike causes.
  std::string text;
  if (!ledger.unauthentic.channels.empty()) {
    text = ledger.unauthentic.channels.front().first +
           ": not authentic: of another run, altered or made up";
  }
  if (!text.empty() && !ledger.first_refused.empty()) text += "; ";
  return CutText(text + ledger.first_refused, kLongestText);
}

morphbus::health_t MakeHealth(const std::string& process, const Ledger& ledger) {
  morphbus::health_t health;
  health.process = process;
  // Wall clock: HEALTH is not in the run's hash.
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  health.wall_time_us = int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
  // The ledger's fields are explained in bridge/bus/bus.h and in health_t.lcm.
  std::tie(health.received, health.sent, health.lost, health.discarded, health.duplicates,
           health.resent, health.asked, health.queue_overflows, health.bad, health.unauthentic,
           health.missed_deadlines, health.old_commands, health.malformed_commands, health.doubled,
           health.delayed, health.corrupted, health.restarts, health.conflicts,
           health.outside_window, health.fragments, health.refused_filters) =
      std::tie(ledger.received, ledger.sent, ledger.lost, ledger.discarded, ledger.duplicates,
               ledger.resent, ledger.asked, ledger.queue_overflows, ledger.bad,
               ledger.unauthentic.all, ledger.missed_deadlines, ledger.old_commands,
               ledger.malformed_commands, ledger.doubled, ledger.delayed, ledger.corrupted,
               ledger.restarts, ledger.conflicts, ledger.outside_window, ledger.fragments,
               ledger.refused_filters);
  health.first_refused = FirstRefused(ledger);
  // What the process has used since it began.
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  health.max_rss_kb = usage.ru_maxrss;
  health.cpu_us = Microseconds(usage.ru_utime) + Microseconds(usage.ru_stime);
  health.num_lateness = health.num_totals = 0;
  // As many channels are named as the datagram has room for; the count of all is above.
  for (const auto& [channel, count] : ledger.unauthentic.channels) {
    if (health.unauthentic_channels.size() == kMostUnauthenticChannels) break;
    health.unauthentic_channels.push_back({CutText(channel, kMaxLocalChannel), count});
  }
  health.num_unauthentic_channels = static_cast<int8_t>(health.unauthentic_channels.size());
  return health;
}

}  // namespace morphbus::bridge
