#pragma once
// A chunk in a file, and its results in another one, as a task of a batch system works them off.
// Whatever ends the task leaves whole lines of results behind, and the next one goes on there.

#include <cstdint>
#include <functional>
#include <string>

#include "tools/sweep/local_engine.h"

namespace morphbus::tools {

/// Reads what has been added to a file of results since it was read last.
class ResultsFile {
 public:
  explicit ResultsFile(std::string path) : path_(std::move(path)) {}
  /// Calls `each` for every whole line that is a result. A line that is none, as one at whose
  /// writing a process died, is left out; one without its end is left for the next time. A file
  /// that is not there has no results. Fails if it cannot be read, or as `each` does.
  Result<void> ReadNew(const std::function<Result<void>(const PlacedResult&)>& each);

 private:
  std::string path_;
  int64_t read_bytes_ = 0;
};

/// Runs the rows of the chunk at `chunk` that have no result at `results`, and appends theirs.
/// Processes and time limits are as in RunLocally. A signal (CatchSignals) ends it; rows under way
/// then have no results. Says what goes wrong, and returns the exit status: 1: a signal ended it;
/// 2: the chunk cannot be read, or is of another build; 3: the results cannot be written.
int ServeChunkFile(const std::string& chunk, const std::string& results,
                   const LocalOptions& options);

}  // namespace morphbus::tools
