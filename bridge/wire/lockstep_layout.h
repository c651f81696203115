#pragma once
// The layouts of what the parties of a lockstep tell each other only, and of replays and their
// followers; part of bridge/wire/message_layout.h, where it is said what a layout is and what `V`
// offers.

#include <cstdint>
#include <morphbus/admit_t.hpp>
#include <morphbus/leave_t.hpp>
#include <morphbus/progress_t.hpp>
#include <morphbus/replay_batch_t.hpp>
#include <morphbus/replay_follow_t.hpp>
#include <morphbus/resend_t.hpp>
#include <morphbus/totals_t.hpp>
#include <morphbus/verdict_t.hpp>

#include "bridge/wire/channels.h"
#include "bridge/wire/layout_base.h"
#include "bridge/wire/wire_limits.h"

namespace morphbus::bridge::layout {

/// Count and hash of a channel. Its name is checked by whoever looks it up.
template <class V>
constexpr void Walk(V& v, As<morphbus::channel_total_t>) {
  v.Text("channel", kMaxChannelName);
  // Distinct payloads, and the chain of their hashes in order.
  v.Int64("count", 0, kMost64);
  v.Hash("chained_hash");
  // Whether the channel counts for the run's hash.
  v.Bool("hashed");
}

/// RESEND (resend_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::resend_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("sender", kMaxProcessName);
  // The outbox knows which of its channels it is, and which of these messages it has.
  v.Text("channel", kMaxChannelName);
  v.Int64("first_sequence", 0, kMost64);
  v.Int64("last_sequence", 0, kMost64);
}

/// PROGRESS (progress_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::progress_t>) {
  v.template Struct<morphbus::header_t>("header");
  // -1 before tick 0 is whole.
  v.Int64("complete_tick", -1, kMost64);
  v.Bool("verdict_heard");
}

/// TOTALS (totals_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::totals_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("process", kMaxProcessName);
  // -1 if there is none.
  v.Int64("last_tick", -1, kMost64);
  WalkPart(v);
  v.Hash("report_hash");
  List16<morphbus::channel_total_t>(v, "num_totals", "totals", kMostTotals);
}

/// VERDICT (verdict_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::verdict_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("error", kLongestText);
}

/// LEAVE (leave_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::leave_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("process", kMaxProcessName);
}

/// ADMIT (admit_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::admit_t>) {
  v.template Struct<morphbus::header_t>("header");
  // Whose HELLO it answers.
  v.Text("module_name", kMaxProcessName);
  v.Hash("claim");
  v.Int64("last_tick", -1, kMost64);
  v.Int64("actuator_count", 0, kMost64);
  v.Int64("status_count", 0, kMost64);
}

/// BATCH (replay_batch_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::replay_batch_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Int64("batch", 0, kMost64);
  v.Bool("ended");
  v.Int64("message_count", 0, kMost64);
  v.Hash("chained_hash");
  v.Bool("last");
}

/// FOLLOW (replay_follow_t).
template <class V>
constexpr void Walk(V& v, As<morphbus::replay_follow_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("follower", kMaxProcessName);
  // -1: none has come.
  v.Int64("batch", -1, kMost64);
  v.Bool("whole");
}

}  // namespace morphbus::bridge::layout
