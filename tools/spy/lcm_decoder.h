#pragma once
// LCM messages by their types: checked byte by byte, and made into JSON if asked.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// Walks one message; every read is checked, and no more than LcmSchema::kMostValues values are
/// looked at. For one message; it may be any bytes.
class LcmDecoder {
 public:
  /// `data` with its fingerprint, which is not looked at, is outlived.
  LcmDecoder(const LcmTypes& types, const uint8_t* data, size_t size)
      : types_(types), data_(data), size_(size) {}

  /// The whole message: true if it is of the type, to the last byte. `out` may be null.
  bool Message(const LcmType& type, nlohmann::ordered_json* out);
  /// True if the message was given up because it holds too many values.
  [[nodiscard]] bool too_long() const { return values_ > LcmSchema::kMostValues; }

 private:
  using Json = nlohmann::ordered_json;
  /// The whole numbers among a struct's members, by index: an array behind them may have them as
  /// its length.
  using Lengths = std::vector<int64_t>;

  /// All members in order.
  bool Struct(const LcmType& type, int depth, Json* out);
  /// The dimensions from `dimension` on; below the last one stands a value.
  bool Array(const LcmMember& member, size_t dimension, const Lengths& lengths, int depth,
             Json* out);
  /// So many bytes as hexadecimal digits, for bytes need not be text.
  bool Bytes(int64_t count, Json* out);
  /// A value that is no array: text, number, truth, an enumeration's value or a nested struct. A
  /// whole number goes to `whole`, too, if that is not null.
  bool Value(const std::string& type, int depth, Json* out, int64_t* whole = nullptr);
  /// A whole number of a primitive type, with its sign.
  bool Whole(const std::string& type, int64_t* out);
  /// A string: its length with the closing zero, then the bytes, then the zero.
  bool Text(Json* out);
  /// An unsigned number of so many bytes, big-endian as all of LCM is.
  bool Unsigned(int bytes, uint64_t* out);

  const LcmTypes& types_;
  const uint8_t* data_;
  size_t size_;
  size_t at_ = 8;       ///< Behind the fingerprint.
  int64_t values_ = 0;  ///< Looked at so far, with the elements of arrays and the arrays.
};

}  // namespace morphbus::tools
