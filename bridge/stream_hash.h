#pragma once
// XXH3 over payloads as they come, and the hash of a whole run.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace morphbus::bridge {

/// XXH3, 64 bits, seed 0, fed piece by piece: the hash of the pieces' concatenation.
class StreamHash {
 public:
  StreamHash();
  ~StreamHash();
  StreamHash(StreamHash&&) noexcept;
  StreamHash& operator=(StreamHash&&) noexcept;

  void Update(const uint8_t* data, size_t size);
  [[nodiscard]] uint64_t Digest() const;

  /// The state as flat bytes of the same build, for a resumed process.
  static constexpr size_t kStateBytes = 576;
  void Save(uint8_t* out) const;
  void Load(const uint8_t* in);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Count and hash of one channel, payloads in sequence order.
struct ChannelTotal {
  std::string channel;  ///< Full name.
  int64_t count = 0;
  uint64_t hash = 0;
  bool hashed = false;  ///< Counts for the run's hash.
};

/// Hash of a run, 32 hexadecimal digits: XXH3 (128 bits) over the hashed channels in order of name,
/// each as name without the run's ("m1/TRANSFORM"), NUL, count and hash (64 bits, big-endian). The
/// run's own name does not enter: two runs of the same robot and program are equal under any name.
std::string RunHash(std::vector<ChannelTotal> totals);

}  // namespace morphbus::bridge
