#pragma once
// One module of a log run again: what differs, and what it knew at a time, as text and as JSON.

#include <cstdint>
#include <optional>
#include <string>

#include "logger/compare/module_rerun.h"
#include "tools/base/json.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// The first field of two JSON values of one type in which they differ: its path, such as
/// "joints[1].target_si", and both values.
struct FieldDifference {
  std::string field;
  std::string logged, again;
};
/// Nothing if they are equal.
std::optional<FieldDifference> FirstDifference(const Json& logged, const Json& again);

/// Collects the messages that a module does not say again as it said them.
class RerunDifferences {
 public:
  /// `schema` is outlived.
  explicit RerunDifferences(const LcmSchema& schema) : schema_(schema) {}

  /// Compares a message, to the bit.
  void Take(const logger::MessageAgain& message);

  /// How many messages differ.
  [[nodiscard]] int64_t count() const { return count_; }
  /// The first of them: "tick", "seconds", "topic", "field", "logged", "again"; null if none does.
  [[nodiscard]] const Json& first() const { return first_; }

 private:
  /// The message by its type; null if there is none.
  [[nodiscard]] Json Decoded(std::span<const uint8_t> bytes) const;

  const LcmSchema& schema_;
  int64_t count_ = 0;
  Json first_;
};

/// What a module knows after a tick: role, pose, labels, conventions, fields, joints, and its tasks
/// with their calls and locals.
Json KnownAfter(const logger::ComputedTick& tick);

/// The same for people, several lines.
std::string KnownText(const Json& known);

}  // namespace morphbus::tools
