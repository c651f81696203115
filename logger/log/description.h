#pragma once
// The run's description (morphbus.proto.RunDescription) as the logger needs it. The only place in
// this folder that knows protobuf.

#include <cstdint>
#include <map>
#include <string>

#include "compiler/base/result.h"

namespace morphbus::logger {

struct LogFacts;
struct RunLog;

/// What a recorder must know of a description before it opens a log.
struct DescriptionKey {
  /// Name of the run, the first part of its channels' names; never empty.
  std::string run;
  /// Hash of the serialized model; every header of the run repeats it.
  uint64_t model_hash = 0;
  /// Version of the software that started the run, for people.
  std::string build;
  /// True for a run in real time, false for one in lockstep.
  bool realtime = false;
};
/// Reads the key from a serialized morphbus.proto.RunDescription. Fails if the bytes are none or
/// name no run.
Result<DescriptionKey> ReadDescriptionKey(const std::string& description);

/// Fills the log's facts, model and robot from a serialized description. It never fails: what is
/// unusable (the bytes, the model, a model that is not the one the description's hash names, a
/// robot that the model lacks) becomes a sentence in facts.problems, and model and robot stay null.
void ApplyDescription(const std::string& description, RunLog* log);

/// Gives the faults in `facts` their sentence, function and source file, with the names of the
/// program and module types that a serialized description carries, or of an image that was deployed
/// during the run. A fault of another program or of an unknown type, and every fault without a
/// description, gets a sentence with numbers in place of names.
void WordFaults(const std::string& description, const std::map<uint64_t, std::string>& deployed,
                LogFacts* facts);

}  // namespace morphbus::logger
