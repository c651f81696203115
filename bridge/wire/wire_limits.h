#pragma once
// How large messages and what they carry may be.

#include <cstddef>
#include <cstdint>

namespace morphbus::bridge {

/// Largest message that a channel of the run may carry, bytes: with LCM's header (8), the longest
/// channel name (64) and IP and UDP (28) the packet stays within 1400 bytes.
inline constexpr size_t kMaxPayloadBytes = 1300;

/// Largest number of a message on its channel. No run is so long, and sums and products of such
/// numbers stay within 64 bits.
inline constexpr int64_t kMostSequence = int64_t{1} << 56;

/// Longest text for people in a message (reasons, errors, builds), bytes.
inline constexpr size_t kLongestText = 200;

/// Largest piece of a new program in SENSORS, bytes.
inline constexpr size_t kMaxDeployPiece = 128;

/// Modules that one HEALTH tells the lateness of.
inline constexpr int kMostLateness = 12;
/// Totals that one HEALTH holds; no process publishes on more channels that count for the hash.
inline constexpr int kMostTopicTotals = 3;

/// Largest description of a run that is accepted, bytes.
inline constexpr size_t kMaxInfoBytes = 16u << 20;

}  // namespace morphbus::bridge
