#pragma once
// Runs rows on this machine, in several processes. A run that crashes or hangs takes its process
// with it and nothing else.

#include <string>

#include "compiler/base/result.h"
#include "tools/sweep/row_source.h"

namespace morphbus::tools {

/// How the local engine runs.
struct LocalOptions {
  /// Processes.
  int jobs = 1;
  /// Wall time that a run may take (s); 0: 60 s and 20 times its simulated time.
  double timeout_s = 0;
  /// Path of the program that the processes run; empty: this one.
  std::string binary = {};
};

/// As many as this process may use processors.
int ProcessorCount();

/// How long a run is, in simulated time (s).
double SimSecondsOf(const RowInputs& inputs);

/// Runs all rows of `source`. Fails if no process can be started, or with an error of `source`.
Result<void> RunLocally(const LocalOptions& options, RowSource* source);

/// What the processes do: takes lines of a chunk from `fd` until it ends, and answers with those of
/// results. Returns the exit status.
int ServeRows(int fd);

}  // namespace morphbus::tools
