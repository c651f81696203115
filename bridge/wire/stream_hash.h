#pragma once
// XXH3 over payloads as they come, and the hash of a whole run. Publishers and the logger work both
// out on their own, and the run went well only if they agree; two runs of the same robot and
// program can be compared by them. (https://github.com/Cyan4973/xxHash)

#include <cstddef>
#include <cstdint>
#include <morphbus/channel_total_t.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus::bridge {

/// XXH3, 64 bits, seed 0, of any bytes.
uint64_t DigestOf(const uint8_t* data, size_t size);

/// XXH3, 64 bits, of what a message says: of its bytes from kContentOffset (bridge/wire/codec.h)
/// on, seeded with its fingerprint. CRC and auth are outside, so that equal runs have equal hashes
/// whatever their keys are. What is shorter than that is no message, and all of it counts.
uint64_t MessageDigest(const uint8_t* data, size_t size);

/// The hash of payloads in a row, as a chain: h(0) = 0, and h(n + 1) is XXH3 (64 bits, seed 0) of
/// 16 bytes, h(n) and the XXH3 of payload n (MessageDigest), both big-endian. A process that has
/// the hash of each message anyway pays for eight bytes a channel and no second pass over the
/// payloads.
class StreamHash {
 public:
  /// Adds a payload by its hash (MessageDigest).
  void Add(uint64_t digest);
  /// Adds a payload by its bytes.
  void Update(const uint8_t* data, size_t size) { Add(MessageDigest(data, size)); }
  /// The hash of all payloads so far; more may follow.
  [[nodiscard]] uint64_t Digest() const { return value_; }
  /// Goes on where a hash had this value.
  void Resume(uint64_t value) { value_ = value; }

 private:
  uint64_t value_ = 0;
};

/// Count and StreamHash of one channel, of distinct payloads in sequence order.
using ChannelTotal = morphbus::channel_total_t;

/// A hash as 16 hexadecimal digits.
std::string HexText(uint64_t hash);

/// XXH3, 128 bits, of any bytes, as 32 hexadecimal digits.
std::string BytesHash(std::string_view bytes);

/// Hash of a run, 32 hexadecimal digits: XXH3 (128 bits) over the hashed channels in order of name,
/// each as name without the run's ("m1/TRANSFORM"), NUL, count and hash (64 bits, big-endian). The
/// run's own name does not enter: two runs of the same robot and program are equal under any name.
std::string RunHash(std::vector<ChannelTotal> totals);

}  // namespace morphbus::bridge
