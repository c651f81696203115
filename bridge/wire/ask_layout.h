#pragma once
// The layout of ASK and of the totals that it carries; part of bridge/wire/message_layout.h, where
// it is said what a layout is and what `V` offers.

#include <cstdint>
#include <morphbus/ask_t.hpp>

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

/// ASK (ask_t), of every kind; what a kind does not use is empty or 0.
template <class V>
constexpr void Walk(V& v, As<morphbus::ask_t>) {
  v.template Struct<morphbus::header_t>("header");
  v.Text("sender", kMaxProcessName);
  v.Int8("kind", morphbus::ask_t::KIND_RESEND, morphbus::ask_t::KIND_BATCH_AGAIN);
  // Of KIND_RESEND: which messages are missing, the last one included.
  v.Text("channel", kMaxChannelName);
  v.Int64("first_sequence", 0, kMost64);
  v.Int64("last_sequence", 0, kMost64);
  // Of KIND_ACK and KIND_END_ACK; -1 before tick 0 is whole, and for all other kinds.
  v.Int64("acknowledged_tick", -1, kMost64);
  // Of the run as the sender knows it; empty if it does not.
  v.Text("run_hash", kRunHashText);
  // Empty if the run ended as planned.
  v.Text("verdict", kLongestText);
  // Of KIND_ADMIT, whose HELLO it answers.
  v.Hash("claim");
  // Of KIND_END_ACK: which part of the sender's totals this is. Other kinds have none.
  const int64_t part = v.Int16("part", 0, kMost16);
  const int64_t parts = v.Int16("num_parts", 0, kMost16);
  if (part > 0 && part >= parts) v.Refuse("part", "is not below num_parts");
  List16<morphbus::channel_total_t>(v, "num_totals", "totals", kMostTotals);
}

}  // namespace morphbus::bridge::layout
