#pragma once
// The run's description (morphbus.proto.RunDescription) as the logger needs it. The only place in
// this folder that knows protobuf.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/world/obstacle.h"

namespace morphbus::bridge {
class ModuleImages;
}

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
  /// True for a run without a key.
  bool open = false;
};
/// Reads the key from a serialized morphbus.proto.RunDescription. Fails if the bytes are none or
/// name no run.
Result<DescriptionKey> ReadDescriptionKey(const std::string& description);

/// Fills the log's facts, model and robot from a serialized description. It never fails: what is
/// unusable (the bytes, the model, a model that is not the one the description's hash names, a
/// robot that the model lacks) becomes a sentence in facts.problems, and model and robot stay null.
void ApplyDescription(const std::string& description, RunLog* log);

/// What stands in the world beside the robot, by a serialized description; none if that says
/// nothing of it, or nothing that can be used.
std::vector<world::Obstacle> ObstaclesIn(const std::string& description);

/// Verifies the images that a serialized description carries and gives them to `images`, those of
/// the module types under their types' names. Fails if the bytes are no description, or for an
/// image that is not usable.
Result<void> LoadImages(const std::string& description, bridge::ModuleImages* images);

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

/// Gives the faults in `facts` their sentence, function and source file, with the names of the
/// program and module types that a serialized description carries, or of an image that was deployed
/// during the run. A fault of another program or of an unknown type, and every fault without a
/// description, gets a sentence with numbers in place of names.
void WordFaults(const std::string& description, const std::map<uint64_t, std::string>& deployed,
                LogFacts* facts);

}  // namespace morphbus::logger
