#include "bridge/wire/health.h"

#include <sys/resource.h>
#include <time.h>

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

void CountLosses(const Bus& bus, Ledger* ledger) {
  const BusLosses losses = bus.losses();
  ledger->queue_overflows = losses.queue_overflows;
  ledger->fragments = losses.fragments;
  ledger->refused_filters = losses.refused_filters;
  ledger->discarded = losses.discarded;
  ledger->doubled = losses.doubled;
  ledger->delayed = losses.delayed;
  ledger->corrupted = losses.corrupted;
  if (ledger->fragments > 0 && ledger->first_refused.empty()) {
    ledger->first_refused = "a fragment of a message that is longer than a datagram";
  }
  // Names are copied only when there is something new.
  const UnauthenticCounts& unauthentic = bus.unauthentic();
  if (unauthentic.all == ledger->unauthentic) return;
  ledger->unauthentic = unauthentic.all;
  ledger->unauthentic_channels.clear();
  // As many channels are named as the datagram has room for; the count of all is above.
  for (const auto& [channel, count] : unauthentic.channels) {
    if (ledger->unauthentic_channels.size() == kMostUnauthenticChannels) break;
    ledger->unauthentic_channels.push_back({CutText(channel, kMaxLocalChannel), count});
  }
}

std::string FirstRefused(const Ledger& ledger) {
  // Both are told, since what came without the key and what was refused have unlike causes.
  std::string text;
  if (!ledger.unauthentic_channels.empty()) {
    text = ledger.unauthentic_channels.front().channel +
           ": not authentic: of another run, altered or made up";
  }
  if (!text.empty() && !ledger.first_refused.empty()) text += "; ";
  return CutText(text + ledger.first_refused, kLongestText);
}

morphbus::health_t MakeHealth(const std::string& process, const Ledger& ledger) {
  morphbus::health_t health = ledger;
  health.process = process;
  // Wall clock: HEALTH is not in the run's hash.
  timespec now = {};
  clock_gettime(CLOCK_REALTIME, &now);
  health.wall_time_us = int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
  health.first_refused = FirstRefused(ledger);
  // What the process has used since it began.
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  health.max_rss_kb = usage.ru_maxrss;
  health.cpu_us = Microseconds(usage.ru_utime) + Microseconds(usage.ru_stime);
  health.num_unauthentic_channels = static_cast<int8_t>(health.unauthentic_channels.size());
  return health;
}

}  // namespace morphbus::bridge
