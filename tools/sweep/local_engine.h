#pragma once
// Runs rows on this machine, in several processes. A run that crashes or hangs takes its process
// with it and nothing else.

#include <functional>
#include <optional>
#include <string>

#include "tools/sweep/chunk.h"

namespace morphbus::tools {

/// Where an engine has its rows from, and where it puts their results.
class RowSource {
 public:
  virtual ~RowSource() = default;
  /// The next row to be run; nothing if there is none left.
  virtual Result<std::optional<RowTask>> Next() = 0;
  /// The bytes of a part that a row names.
  virtual Result<std::string> Part(const std::string& hash) = 0;
  virtual Result<void> Take(const RowTask& task, const RowResult& result) = 0;
  /// Called several times a second. False: to stop now; runs under way have no results.
  virtual bool GoOn() = 0;
};

/// How the local engine runs.
struct LocalOptions {
  /// Processes.
  int jobs = 1;
  /// Wall time that a run may take (s); 0: 60 s and 20 times its simulated time.
  double timeout_s = 0;
};

/// Runs all rows of `source`. Fails if no process can be started, or with an error of `source`.
Result<void> RunLocally(const LocalOptions& options, RowSource* source);

/// What the processes do: takes lines of a chunk from `fd` until it ends, and answers with those of
/// results. Returns the exit status.
int ServeRows(int fd);

}  // namespace morphbus::tools
