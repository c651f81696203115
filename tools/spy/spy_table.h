#pragma once
// What the spy has heard on the bus: channels, processes, runs.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/base/json.h"
#include "tools/spy/channel_table.h"
#include "tools/spy/description_table.h"
#include "tools/spy/lcm_schema.h"
#include "tools/spy/message_fields.h"
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

  /// The serialized description of a run, by which its messages have names; those of INFO it takes
  /// by itself. `now_ns` is on the clock of Take.
  void KnowDescription(const std::string& description, int64_t now_ns) {
    descriptions_.Know(description, now_ns);
  }
  /// As in ChannelTable.
  void KnowKey(const std::string& run, const bridge::RunKey& key) { channels_.KnowKey(run, key); }

  /// A message of `channel` that arrived at `arrival_ns`, nanoseconds on any clock.
  void Take(std::string_view channel, const uint8_t* data, size_t size, int64_t arrival_ns);

  /// What is known at `now_ns` on the clock of Take.
  [[nodiscard]] SpySnapshot Snapshot(int64_t now_ns) const;

  /// The last message of a channel as an object, with hashes as hexadecimal texts and the sentences
  /// of a STATUS's faults under "text"; or why there is none.
  [[nodiscard]] Result<Json> LastOf(const std::string& channel) const;
  /// The same as fields for people, with the names that the run's description has.
  [[nodiscard]] Result<MessageFields> FieldsOfLast(const std::string& channel) const;
  /// The last message of a channel as its bytes; null if none is kept.
  [[nodiscard]] const std::vector<uint8_t>* BytesOfLast(const std::string& channel) const {
    return channels_.Last(channel);
  }
  /// Keeps the last message of this channel, however long it is and however many others are kept;
  /// "" watches none.
  void Watch(const std::string& channel) { channels_.Watch(channel); }

 private:
  /// The names of the run whose message this is.
  [[nodiscard]] RunNames NamesOf(const bridge::RunMessage& message) const {
    return descriptions_.NamesOf(message.name.run).Of(message.header.model_hash);
  }

  LcmSchema schema_;
  ChannelTable channels_;
  ProcessTable processes_;
  DescriptionTable descriptions_;
  int64_t begin_ns_ = -1;  ///< The first message; -1: none has come.
};

}  // namespace morphbus::tools
