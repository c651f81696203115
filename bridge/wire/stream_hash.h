#pragma once
// XXH3 over payloads as they come, and the hash of a whole run. Publishers and the logger work both
// out on their own, and the run went well only if they agree; two runs of the same robot and
// program can be compared by them. (https://github.com/Cyan4973/xxHash)

#include <cstddef>
#include <cstdint>
#include <memory>
#include <morphbus/channel_total_t.hpp>
#include <string>
#include <vector>

namespace morphbus::bridge {

/// XXH3, 64 bits, seed 0, fed piece by piece: the hash of the pieces' concatenation.
class StreamHash {
 public:
  StreamHash();
  // It can be moved, but not copied.
  ~StreamHash();
  StreamHash(StreamHash&&) noexcept;
  StreamHash& operator=(StreamHash&&) noexcept;

  /// Adds a payload's bytes.
  void Update(const uint8_t* data, size_t size);
  /// The hash of all bytes so far; more may follow.
  [[nodiscard]] uint64_t Digest() const;
  /// The hash that there would be after these bytes, which are not added.
  [[nodiscard]] uint64_t DigestWith(const uint8_t* data, size_t size) const;

  /// The state as flat bytes of the same build, for a resumed process. Both take kStateBytes bytes
  /// at `out` or `in`; a state that is damaged yields a wrong hash, but no access out of bounds.
  static constexpr size_t kStateBytes = 576;
  void Save(uint8_t* out) const;
  void Load(const uint8_t* in);

 private:
  // xxHash's state, kept out of this header.
  struct State;
  std::unique_ptr<State> state_;
};

/// XXH3, 64 bits, seed 0, of one payload.
uint64_t DigestOf(const uint8_t* data, size_t size);

/// Count and hash of one channel, distinct payloads in sequence order.
struct ChannelTotal {
  /// Full name of the channel, the run's name included.
  std::string channel;
  /// Payloads, each counted once however often it was sent.
  int64_t count = 0;
  /// XXH3, 64 bits, of their bytes.
  uint64_t hash = 0;
  bool hashed = false;  ///< Counts for the run's hash.
};

/// The total as messages carry it.
morphbus::channel_total_t ToWire(const ChannelTotal& total);

/// A hash as 16 hexadecimal digits.
std::string HexText(uint64_t hash);

/// Hash of a run, 32 hexadecimal digits: XXH3 (128 bits) over the hashed channels in order of name,
/// each as name without the run's ("m1/TRANSFORM"), NUL, count and hash (64 bits, big-endian). The
/// run's own name does not enter: two runs of the same robot and program are equal under any name.
std::string RunHash(std::vector<ChannelTotal> totals);

}  // namespace morphbus::bridge
