#pragma once
// How large messages and what they carry may be. bridge/wire/wire_ranges.cc holds the ranges of
// lcmtypes/*.lcm to it.

#include <cstddef>
#include <cstdint>

namespace morphbus::bridge {

/// Largest message that a channel of the run may carry, bytes: with LCM's header (8) and the
/// longest channel name (64) the datagram stays under 1400 bytes.
inline constexpr size_t kMaxPayloadBytes = 1308;

/// Largest number of a message on its channel. No run is so long, and sums and products of such
/// numbers stay within 64 bits.
inline constexpr int64_t kMostSequence = int64_t{1} << 56;

/// Longest text for people in a message (reasons, errors, builds), bytes.
inline constexpr size_t kLongestText = 200;

/// Longest value of a program as text, bytes.
inline constexpr size_t kMaxValueText = 96;

/// Largest piece of a new program in SENSORS, bytes.
inline constexpr size_t kMaxDeployPiece = 128;

/// Modules that one HEALTH tells the lateness of.
inline constexpr int kMostLateness = 8;
/// Totals that one HEALTH holds; no process publishes on more channels that count for the hash.
inline constexpr int kMostTopicTotals = 3;

/// Totals that one TOTALS holds; the log's END has more.
inline constexpr size_t kMostTotals = 32;

/// Channels of which one HEALTH tells how much came there that had not the run's key.
inline constexpr int kMostUnauthenticChannels = 4;

/// Largest description of a run that is accepted, bytes.
inline constexpr size_t kMaxInfoBytes = 16u << 20;

}  // namespace morphbus::bridge
