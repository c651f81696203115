#pragma once
// The layout of HEALTH, as bridge/wire/message_layout.h has those of the other messages.

#include <morphbus/health_t.hpp>

#include "bridge/wire/message_layout.h"

namespace morphbus::bridge::layout {

/// How punctual a module is. Nothing in it is below 0.
template <class V>
constexpr void Walk(V& v, As<morphbus::lateness_t>) {
  v.Text("module_name", kMaxProcessName);
  // Of those that were missed, some came later.
  const int64_t missed = v.Int64("missed", 0, kMost64);
  if (v.Int64("late", 0, kMost64) > missed) v.Refuse("late", "is above missed");
  v.Int64("worst_us", 0, kMost64);
}

/// What the process has published on a channel.
template <class V>
constexpr void Walk(V& v, As<morphbus::topic_total_t>) {
  v.Text("topic", kMaxTopicName);
  v.Int64("count", 0, kMost64);
  v.Hash("chained_hash");
}

/// How many messages came on a channel.
template <class V>
constexpr void Walk(V& v, As<morphbus::channel_count_t>) {
  v.Text("channel", kMaxLocalChannel);
  v.Int64("count", 0, kMost64);
}

/// HEALTH (health_t). A ledger only counts, so nothing in it is below 0.
template <class V>
constexpr void Walk(V& v, As<morphbus::health_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("process", kMaxProcessName);
  // Time and use are those of the process, the others are its ledger.
  for (const char* count : {"wall_time_us",
                            "received",
                            "sent",
                            "lost",
                            "discarded",
                            "duplicates",
                            "resent",
                            "asked",
                            "queue_overflows",
                            "bad",
                            "unauthentic",
                            "missed_deadlines",
                            "old_commands",
                            "malformed_commands",
                            "doubled",
                            "delayed",
                            "corrupted",
                            "restarts",
                            "conflicts",
                            "outside_window",
                            "fragments",
                            "refused_filters"}) {
    v.Int64(count, 0, kMost64);
  }
  // For people only.
  v.Text("first_refused", kLongestText);
  v.Int64("max_rss_kb", 0, kMost64);
  v.Int64("cpu_us", 0, kMost64);
  // Of the sim's: modules that missed a deadline.
  List8<morphbus::lateness_t>(v, "num_lateness", "lateness", kMostLateness);
  List8<morphbus::topic_total_t>(v, "num_totals", "totals", kMostTopicTotals);
  List8<morphbus::channel_count_t>(v, "num_unauthentic_channels", "unauthentic_channels",
                                   kMostUnauthenticChannels);
}

}  // namespace morphbus::bridge::layout
