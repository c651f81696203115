#pragma once
// The run's description (morphbus.proto.RunDescription) as the logger needs it. The only place in
// this folder that knows protobuf.

#include <cstdint>
#include <string>

#include "compiler/source/result.h"

namespace morphbus::logger {

struct RunLog;

/// What a recorder must know of a description.
struct DescriptionKey {
  std::string run;
  uint64_t model_hash = 0;
  std::string build;
  bool realtime = false;
};
Result<DescriptionKey> ReadDescriptionKey(const std::string& description);

/// A description from a file, at most 16 MiB.
Result<std::string> ReadDescriptionFile(const std::string& path);

/// Fills the log's facts, model and robot from a serialized description; what is unusable is listed
/// in facts.problems.
void ApplyDescription(const std::string& description, RunLog* log);

}  // namespace morphbus::logger
