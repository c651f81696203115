#pragma once
// The fields of a channel's messages, and how they have changed.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/spy/message_fields.h"

namespace morphbus::tools {

/// A field of the newest message.
struct FieldRow : MessageField {
  /// Its last values, oldest first; empty for what is no number.
  std::vector<double> history;
};

/// The fields of one channel, with the history of those that are numbers. Memory is bounded:
/// MessageFields::kMost fields of a message, the history of 500 of them, 200 values each.
class FieldHistory {
 public:
  static constexpr size_t kMostHistories = 500;
  static constexpr size_t kMostValues = 200;

  /// The fields of a message. Those that it no longer has are forgotten.
  void Take(MessageFields message);
  /// The fields of the newest message in its order.
  [[nodiscard]] const std::vector<FieldRow>& fields() const { return fields_; }
  /// Fields of the newest message beyond those.
  [[nodiscard]] int64_t more() const { return more_; }

 private:
  std::vector<FieldRow> fields_;
  std::map<std::string, std::vector<double>> histories_;  ///< By path.
  int64_t more_ = 0;
};

}  // namespace morphbus::tools
