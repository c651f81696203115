#pragma once
// The fields of a decoded message as people read them: hashes in hexadecimal digits, names for
// numbers that stand for something.

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "tools/base/json.h"
#include "tools/spy/lcm_schema.h"
#include "tools/spy/run_names.h"

namespace morphbus::tools {

/// A field of a message.
struct MessageField {
  /// "header.tick", "joints[joint_1].mode", "link_poses[0].position_m[2]".
  std::string path;
  /// As text; strings in quotation marks, bytes and hashes in hexadecimal digits.
  std::string value;
  /// The value where it is a number or a truth value, else not a number.
  double number = std::numeric_limits<double>::quiet_NaN();
};

/// The fields of one message.
struct MessageFields {
  static constexpr size_t kMost = 2000;
  /// In their order, but those of the header of our own come last, for nobody opens a message for
  /// them.
  std::vector<MessageField> fields;
  int64_t more = 0;  ///< Fields beyond the first kMost.
};

/// What gives the fields of a message their words.
struct FieldWords {
  const LcmSchema* schema = nullptr;
  const LcmType* type = nullptr;  ///< Of the message, of that schema; null: there are no words.
  RunNames names = {};            ///< Of the run, if it is one's message.
  std::string_view process = {};  ///< Whose channel it came on.
};

/// The fields of a message that LcmSchema::Decode made, or of any object. A value that has a
/// constant of its type, which begins with the field's name (`mode`, MODE_HOLD), is shown by the
/// rest of the constant's name.
MessageFields FieldsOf(const Json& message, const FieldWords& words = {});

/// Turns the hashes in a decoded message of ours into texts of hexadecimal digits, as `info` has
/// them: 64 bits are no number that every reader of JSON can hold.
void WriteHashes(const LcmSchema& schema, const LcmType& type, Json* message);

}  // namespace morphbus::tools
