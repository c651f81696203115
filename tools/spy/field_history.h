#pragma once
// The fields of a channel's messages, and how they have changed.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/base/json.h"

namespace morphbus::tools {

/// A field of the newest message.
struct FieldRow {
  std::string path;   ///< "header.tick", "link_poses[0].position_m[2]".
  std::string value;  ///< As text; strings in quotation marks, bytes in hexadecimal digits.
  double number = 0;  ///< The value where it is a number or a truth value, else not a number.
  /// Its last values, oldest first; empty for what is no number.
  std::vector<double> history;
};

/// The fields of one channel, with the history of those that are numbers. Memory is bounded: 2000
/// fields of a message, the history of 500 of them, 200 values each.
class FieldHistory {
 public:
  static constexpr size_t kMostFields = 2000;
  static constexpr size_t kMostHistories = 500;
  static constexpr size_t kMostValues = 200;

  /// A message, decoded. Fields that it no longer has are forgotten.
  void Take(const Json& message);
  /// The fields of the newest message in its order, but those of the header of our own come last.
  [[nodiscard]] const std::vector<FieldRow>& fields() const { return fields_; }
  /// Fields of the newest message beyond those.
  [[nodiscard]] int64_t more() const { return more_; }

 private:
  /// Notes a value and all that is in it under `path`.
  void Walk(const Json& value, const std::string& path);

  std::vector<FieldRow> fields_;
  std::map<std::string, std::vector<double>> histories_;  ///< By path.
  int64_t more_ = 0;
};

}  // namespace morphbus::tools
