#pragma once
// What the logger has received on the channels that count for the run's hash.

#include <cstdint>
#include <map>
#include <memory>
#include <morphbus/topic_total_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/lockstep/sequence_tracker.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/stream_hash.h"
#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// One hashed channel as received: counts its payloads and hashes them in the order of their
/// numbers.
struct ReceivedStream {
  ChannelName name;         ///< Of the channel, taken apart.
  int module = -1;          ///< Whose it is, by the machine's number; -1: not a module's.
  int index = 0;            ///< Among all streams, in the order of their beginnings.
  SequenceTracker tracker;  ///< Of the numbers that came.
  int64_t next = 0;         ///< Number of the next payload to hash.
  int64_t count = 0;        ///< Distinct messages.
  StreamHash hash;
  bool gapless = true;  ///< Every number came when it was its turn.
  /// Hashes of payloads beyond a gap, by number; bounded by the machine's window.
  std::map<int64_t, uint64_t> early;
  std::string_view channel;  ///< Its name, which the streams hold.
  /// The one of the message that came after the last one here.
  ReceivedStream* follower = nullptr;

  /// Takes a new payload by its XXH3. `in_order`: those beyond a gap wait until it is filled.
  void Add(int64_t sequence, uint64_t digest, bool in_order);
};

/// The streams of all channels of a run.
class ReceivedStreams {
 public:
  /// What has come on a channel; null if nothing has. The streams of a thousand modules are more
  /// than a processor has at hand; one tick is like another, so that it fetches the next one
  /// meanwhile.
  ReceivedStream* Find(std::string_view channel);
  /// Begins to note what comes on a hashed channel, of which nothing has come yet.
  /// @param module   as in ReceivedStream.
  /// @param numbers  of so many of the last ones the bytes are to be remembered, within bounds.
  ReceivedStream& Begin(std::string_view channel, int module, int64_t numbers);

  /// Count and hash of every channel, in order of name.
  [[nodiscard]] std::vector<ChannelTotal> totals() const;
  /// The first topic of which a process says that it has published other messages than have come;
  /// empty if there is none. What is under way, or was lost and is asked for, is left out.
  /// @param prefix    of the process's channels: "RUN/PROCESS/".
  /// @param realtime  what is lost is never asked for.
  [[nodiscard]] std::string FirstDifference(const std::string& prefix,
                                            const std::vector<morphbus::topic_total_t>& published,
                                            bool realtime) const;

 private:
  TextTable<std::unique_ptr<ReceivedStream>> streams_;  ///< By full name of the channel.
  ReceivedStream* last_ = nullptr;                      ///< The one that was found last.
};

}  // namespace morphbus::bridge
