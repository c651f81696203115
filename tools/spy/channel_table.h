#pragma once
// The channels that were heard: counts, rates, losses, the last message.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/observe/gap_counter.h"
#include "bridge/observe/run_message.h"
#include "bridge/wire/run_key.h"
#include "tools/spy/arrival_stats.h"
#include "tools/spy/heard_names.h"
#include "tools/spy/lcm_schema.h"
#include "tools/spy/spy_snapshot.h"

namespace morphbus::tools {

/// All channels, 4096 at most, of anybody's programs. Last messages are kept within 32 MiB; of a
/// channel that is watched, always.
class ChannelTable {
 public:
  // Bounds on channels, and on the bytes of all last messages together.
  static constexpr size_t kMostChannels = 4096;
  static constexpr size_t kMostKeptBytes = size_t{32} << 20;

  /// `schema` must outlive the table.
  explicit ChannelTable(const LcmSchema* schema) : schema_(schema) {}

  /// From now on messages of this run that have not its key are bad, and marked. Without a name it
  /// is the run of the first message that has the key.
  void KnowKey(const std::string& run, const bridge::RunKey& key) {
    run_ = run;
    key_ = key;
  }

  /// A message of `channel` that arrived at `arrival_ns` (any clock). Returns it if it is a sound
  /// one of ours that was not heard before, by its number.
  std::optional<bridge::RunMessage> Take(std::string_view channel, const uint8_t* data, size_t size,
                                         int64_t arrival_ns);

  /// Appends all channels, in order of name, with their figures at `now_ns`.
  void Snapshot(int64_t now_ns, SpySnapshot* out) const;

  /// Keeps the last message of this channel, however long it is; "" watches none.
  void Watch(const std::string& channel) { watched_ = channel; }
  /// The last message of a channel; null if none is kept.
  [[nodiscard]] const std::vector<uint8_t>* Last(std::string_view channel) const;

 private:
  /// What was heard on one channel.
  struct Stream {
    ChannelRow row;                 ///< But for what a moment needs: type, losses, arrivals.
    const LcmType* type = nullptr;  ///< Of the last message whose type was known.
    ArrivalStats arrivals;          ///< Of all messages.
    bridge::GapCounter gaps;        ///< In the numbers of ours.
    std::vector<uint8_t> last;      ///< The newest message as it came; empty if it was not kept.
    /// The bytes that all channels keep; null before the first message.
    size_t* kept = nullptr;
    // `kept` counts its bytes, so that it must not be copied.
    Stream() = default;
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;
    ~Stream() {
      if (kept != nullptr) *kept -= last.size();
    }
  };

  /// Whether the message is of the type that its first bytes name; counts what is not.
  void TakeForeign(const uint8_t* data, size_t size, Stream* stream) const;
  /// Keeps the message if there is room.
  void Keep(std::string_view channel, const uint8_t* data, size_t size, Stream* stream);

  const LcmSchema* schema_;
  std::string run_;     ///< Whose key is known; empty: nobody's yet.
  bridge::RunKey key_;  ///< Open while none is known.
  size_t kept_bytes_ = 0;
  HeardNames<Stream> streams_{kMostChannels};
  std::string watched_;  ///< The channel whose last message is kept always.
};

}  // namespace morphbus::tools
