#pragma once
// What the spy has seen on the bus: per channel counts, rates, bandwidth, losses; who plays which
// role.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/lockstep/sequence_tracker.h"
#include "tools/base/json.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// Which channels' last messages are to be shown, by their names.
using ChannelFilter = std::function<bool(const std::string&)>;

/// What has been heard on the bus since the spy began. It never grows beyond 4096 channels,
/// whatever other programs publish. It works on bytes alone and knows no bus and no clock: the
/// command `spy` feeds it, and tests do.
class SpyTable {
 public:
  /// `schema` decodes the messages; what it does not know is counted, but not shown.
  explicit SpyTable(LcmSchema schema) : schema_(std::move(schema)) {}

  /// A message of `channel` that arrived at `now_s` (any clock that does not go back).
  void Take(std::string_view channel, const uint8_t* data, size_t size, double now_s);

  /// Begins the next interval: rates are those of the one that ends now, at `now_s` on the clock of
  /// Take.
  void Roll(double now_s);

  /// `{"seconds":…,"channels":[{"channel":…,"type":…,"messages":…,"hz":…,"bytes_per_s":…,"lost":…,
  /// "bad":…}],"modules":{"m1":{"role":…}}}`; channels that are `selected` have their last message
  /// decoded under "last", or the reason why it cannot be decoded.
  [[nodiscard]] Json ToJson(const ChannelFilter& selected) const;

 private:
  /// What was heard on one channel.
  struct Stream {
    std::string type;      ///< "" until a message decoded.
    int64_t messages = 0;  ///< Since the spy began; so are the bytes.
    /// Payload bytes, without the headers of LCM and UDP.
    int64_t bytes = 0;
    int64_t bad = 0;                ///< Neither known nor sound.
    int64_t late = 0;               ///< Filled gaps.
    int64_t interval_messages = 0;  ///< Since Roll.
    /// Payload bytes since Roll.
    int64_t interval_bytes = 0;
    double hz = 0.0;  ///< Messages a second in the last interval.
    /// Payload bytes a second in the last interval.
    double bytes_per_s = 0.0;
    /// What is lost by the gaps in the sequence numbers.
    bridge::Ledger ledger;
    bridge::SequenceTracker tracker;  ///< Finds gaps, which `ledger` counts.
    std::vector<uint8_t> last;        ///< The newest message as it came.
  };

  LcmSchema schema_;
  /// By channel; std::less<> lets it be searched without making a string of each name.
  std::map<std::string, Stream, std::less<>> streams_;
  std::map<std::string, std::string> roles_;  ///< By module.
  /// When the first message came; negative: none has come.
  double begin_s_ = -1.0;
  /// When the running interval began: at the first message, then at each Roll.
  double interval_begin_s_ = -1.0;
  /// The newest time that Take or Roll was told.
  double now_s_ = 0.0;
};

/// What ToJson gives as text for a terminal of `width` columns and `height` lines (0: without
/// limit): channels, roles, fields of the selected channels. Each of the three gets its share of
/// the lines and ends with how many of its lines were left out. `pattern` is what selected the
/// channels ("" if nothing did); if it selected none, the text says so.
std::string SpyText(const Json& spy, const std::string& pattern, int width, int height);

}  // namespace morphbus::tools
