#pragma once
// The run's description (morphbus.proto.RunDescription) of a log. The only place in this folder
// that knows protobuf.

#include <cstdint>
#include <string>

#include "compiler/base/result.h"

namespace morphbus::logger {

struct LogFacts;
struct RunLog;

/// Fills the log's facts, `described`, model and robot from a serialized description. It never
/// fails: what is unusable (the bytes, the model, a model that is not the one the description's
/// hash names, a robot that the model lacks) becomes a sentence in facts.problems, and model and
/// robot stay null.
void ApplyDescription(const std::string& description, RunLog* log);

/// The first serialized description that a log holds whole. Fails if the log cannot be read or
/// holds none.
Result<std::string> DescriptionInLog(const std::string& path);
/// The serialized description in the file `path`: the bytes of one, as `morphbus convert --to
/// description` writes them, or a log, whose first whole description is meant. Fails if the file
/// cannot be read or holds none.
Result<std::string> ReadDescription(const std::string& path);

/// ApplyDescription() with the description of another recording, for a log that holds none because
/// it was begun too late. `model_hash` is that of which the log's messages speak. A description of
/// another run lends its model, robot and program only: seed, options and times were that run's
/// own, and facts.problems says so. Sets log->description. Fails if the description cannot be read
/// or is of another model.
Result<void> BorrowDescription(const std::string& description, uint64_t model_hash, RunLog* log);

/// Gives the faults in the log's facts their sentence, function and source file, with the names of
/// the program and module types that its description has, or of an image that was deployed during
/// the run. A fault of another program or of an unknown type, and every fault without a
/// description, gets a sentence with numbers in place of names.
void WordFaults(RunLog* log);

}  // namespace morphbus::logger
