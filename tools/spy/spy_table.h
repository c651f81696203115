#pragma once
// What the spy has heard on the bus: channels, processes, runs.

#include <cstdint>
#include <string>
#include <string_view>

#include "tools/base/json.h"
#include "tools/spy/channel_table.h"
#include "tools/spy/lcm_schema.h"
#include "tools/spy/process_table.h"
#include "tools/spy/spy_snapshot.h"

namespace morphbus::tools {

/// Everything that has been heard since the spy began. Memory is bounded, whatever other programs
/// publish (HeardNames). It works on bytes alone and knows no bus and no clock: the command `spy`
/// feeds it, and tests do.
class SpyTable {
 public:
  /// `schema` decodes the messages; what it does not know is counted, but not shown.
  explicit SpyTable(LcmSchema schema);
  SpyTable(const SpyTable&) = delete;
  SpyTable& operator=(const SpyTable&) = delete;

  /// As in ChannelTable.
  void KnowKey(const std::string& run, const bridge::RunKey& key) { channels_.KnowKey(run, key); }

  /// A message of `channel` that arrived at `arrival_ns`, nanoseconds on any clock.
  void Take(std::string_view channel, const uint8_t* data, size_t size, int64_t arrival_ns);

  /// What is known at `now_ns` on the clock of Take.
  [[nodiscard]] SpySnapshot Snapshot(int64_t now_ns) const;

  /// The last message of a channel as an object, with the sentences of a STATUS's faults under
  /// "text"; or why there is none.
  [[nodiscard]] Result<Json> LastOf(const std::string& channel) const;
  /// Keeps the last message of this channel, however long it is and however many others are kept;
  /// "" watches none.
  void Watch(const std::string& channel) { channels_.Watch(channel); }

 private:
  LcmSchema schema_;
  ChannelTable channels_;
  ProcessTable processes_;
  int64_t begin_ns_ = -1;  ///< The first message; -1: none has come.
};

}  // namespace morphbus::tools
