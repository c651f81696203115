#pragma once
// Where rows run: here, on a cluster, or on other machines. The rows are the same.

#include <functional>
#include <string>
#include <tl/expected.hpp>

#include "tools/sweep/engine_settings.h"
#include "tools/sweep/row_source.h"

namespace morphbus::tools {

/// Which engine runs rows, and how.
struct EngineOptions {
  EngineSettings settings;
  /// Rows at a time: on this machine, in a task, on a host; 0: as many as there are processors, or
  /// as the settings say.
  int jobs = 0;
  /// Wall time that a run may take (s); 0: 60 s and 20 times its simulated time.
  double timeout_s = 0;
  /// Where Slurm's jobs have their files, beside the database; the nodes see it, too.
  std::string folder;
  /// What a batch system works at is of use to this call alone: it is ended with it.
  bool once = false;
  /// Leave once a batch system has everything.
  bool detach = false;
  /// Rows that failed are wanted again, so that a failure which an earlier call's job has left is
  /// not taken.
  bool retry = false;
};

/// Why an engine could not go on.
struct EngineError {
  // An error of the system is one of the run.
  EngineError(Error error) : message(std::move(error.message)) {}  // NOLINT
  EngineError(std::string text, bool is_unusable)
      : message(std::move(text)), unusable(is_unusable) {}
  std::string message;
  /// It cannot be as it was asked for (exit status 2); else something failed (3).
  bool unusable = false;
};
using EngineResult = tl::expected<void, EngineError>;

/// The failure of an engine that cannot run rows as it was asked for.
[[nodiscard]] inline tl::unexpected<EngineError> NoEngine(std::string message) {
  return tl::unexpected<EngineError>(EngineError(std::move(message), true));
}

/// Path of the program on another machine: that of the host or else of the settings, or else this
/// program's own. Fails if that was replaced since it started.
Result<std::string> BinaryOf(const EngineSettings& settings, const std::string& of_host);

/// Runs the rows of `source`. Those that were run before it fails have been taken.
EngineResult RunByEngine(const EngineOptions& options, RowSource* source);

}  // namespace morphbus::tools
