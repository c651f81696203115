#pragma once
// What the spy has seen on the bus: per channel counts, rates, bandwidth, losses; who plays which
// role.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/sequence_tracker.h"
#include "tools/cli.h"
#include "tools/lcm_schema.h"

namespace morphbus::tools {

class SpyTable {
 public:
  explicit SpyTable(LcmSchema schema) : schema_(std::move(schema)) {}

  /// A message of `channel` that arrived at `now_s` (any clock that does not go back).
  void Take(std::string_view channel, const uint8_t* data, size_t size, double now_s);

  /// Begins the next interval: rates are those of the one that ends now.
  void Roll(double now_s);

  /// `{"seconds":…,"channels":[{"channel":…,"type":…,"messages":…,"hz":…,"bytes_per_s":…,"lost":…,
  /// "bad":…}],"modules":{"m1":{"role":…}}}`; with `selected`, that channel's last message decoded
  /// under "last".
  [[nodiscard]] Json ToJson(const std::string& selected) const;

 private:
  struct Row {
    std::string type;  ///< "" until a message decoded.
    int64_t messages = 0;
    int64_t bytes = 0;
    int64_t bad = 0;   ///< Neither known nor sound.
    int64_t late = 0;  ///< Filled gaps.
    int64_t interval_messages = 0;
    int64_t interval_bytes = 0;
    double hz = 0.0;
    double bytes_per_s = 0.0;
    bridge::Ledger ledger;
    bridge::SequenceTracker tracker;
    std::vector<uint8_t> last;
  };

  LcmSchema schema_;
  std::map<std::string, Row, std::less<>> rows_;
  std::map<std::string, std::string> roles_;  ///< By module.
  double begin_s_ = -1.0;
  double interval_begin_s_ = -1.0;
  double now_s_ = 0.0;
};

/// The table for a terminal of `width` columns and `height` lines (0: without limit).
std::string SpyText(const Json& spy, const std::string& selected, int width, int height);

}  // namespace morphbus::tools
