#pragma once
// What `morphbus optimise` and the subcommands of `morphbus sweep` share.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "compiler/source/diagnostics.h"
#include "tools/base/messages.h"
#include "tools/base/options.h"
#include "tools/sweep/engine.h"
#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// The options of `morphbus sweep run` and of those that look at what it left.
struct SweepOptions {
  /// The sweep's file, or its database.
  std::string file;
  /// NAME=VALUES, over what the file says.
  std::vector<std::string> overrides;
  std::string output;
  /// Which engine runs the rows; empty: as the file says.
  std::string engine;
  /// What the file says of engines.
  EngineSettings engines;
  /// Path of the program that runs the rows, over what the file says.
  std::string binary;
  bool detach = false;
  int jobs = 0;  ///< Rows at a time; 0: as the engine chooses.
  double timeout = 0;
  bool dry_run = false;
  bool retry = false;
  bool json = false;
  bool force = false;
  int row = 0;
  std::string log;
  double sample = 0.05;
  uint64_t seed = 1;
  std::string format;
  /// Of the page: by which expression rows are ranked, and how many are shown.
  std::string by;
  bool smallest = false;
  int best = 5;
  int fd = -1;
  std::string chunk;
};

/// The database of a sweep's file, beside it: walk.toml has walk.sweep.db.
std::string DatabaseOf(const std::string& file);
/// What the file says, and where it lies; nothing after saying why it cannot be read.
std::optional<SweepOrigin> OriginOf(const SweepOptions& options);
/// The file, understood by `read`: ReadSweepFile or ReadSearchFile. Nothing after saying what is
/// wrong with it.
template <typename Read>
auto ReadOrigin(const SweepOptions& options, const SweepOrigin& origin, const Read& read) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int number = sources.AddText(options.file, origin.text);
  auto file = read(&sources, number, options.file, origin.words, &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  return file;
}
/// The database that the user named, by its own name or that of the sweep's file, opened for
/// reading. Null after saying why it cannot be used.
std::unique_ptr<SweepStore> OpenNamed(const std::string& name);
/// How many rows are in which state, as every command's --json says it first.
Json CountsJson(const std::string& database, const RowCounts& counts);
/// Says why an engine could not go on, and returns the exit status of that.
int EngineFailed(const EngineError& error);
/// Adds the options of those that run rows: --engine, --binary, --jobs and --timeout.
void AddEngine(Subcommand* sub, SweepOptions* options);
/// Takes the engines of a file in `folder` into the options. False after saying so if --engine
/// names none.
bool ChooseEngine(const EngineSettings& engines, const std::string& folder, SweepOptions* options);
/// How many rows run at a time on this machine: as many as were asked for, or one a processor.
int JobsOf(const SweepOptions& options);
/// "3.1 h with 8 processes", or, of an engine that is elsewhere, "3.1 h of one processor's time".
std::string EstimateText(double run_seconds, const SweepOptions& options);

/// Runs rows of a store once more, by the engine of the options. Rows whose logs are kept, for
/// which `logs` stands, need a folder that this machine has: ssh leaves them to it.
EngineResult RunAgain(RowSource* rows, const SweepStore& store, const SweepOptions& options,
                      bool logs = false);
/// The last rows of a store, behind which others will stand.
struct LastRows {
  int64_t from = 1;
  /// What stands before the progress.
  std::string label;
};
/// Runs the rows that have no result, of all or of the last ones. Once all have one, nothing is
/// left of jobs; where none of the last ones is missing, jobs that others wait for are left alone.
/// Says what goes wrong, and returns the exit status of that.
int RunMissing(SweepStore* store, const SweepOptions& options,
               const std::optional<LastRows>& last = std::nullopt);

/// Adds those that look at a database, or run rows of it again: status, missing, rerun, verify,
/// export, report; and worker, which the others start.
void AddSweepQueries(Subcommand* sweep);

}  // namespace morphbus::tools
