#pragma once
// One run of a sweep, from its inputs to its figures.

#include <string>

#include "tools/launch/run_outcome.h"
#include "tools/launch/run_record.h"

namespace morphbus::tools {

/// How a row's run went.
struct RowResult {
  /// Done; failed as a run can fail (why is in `error`); its process crashed, or was ended after
  /// its time was over.
  enum class Status { kRan, kErred, kCrashed, kTimeout };
  Status status = Status::kErred;
  /// The run's hash; empty if it did not end well.
  std::string hash;
  /// The figures of RunFigures() by name, on one line.
  std::string figures = "{}";
  std::string error;
  /// Wall time of the run alone, on this host, and the version of the software.
  double seconds = 0;
  std::string host, version;
};

/// A result with this host and version, still to be filled in.
RowResult NewResult();

/// "done", "failed", "crashed", "timeout".
const char* StatusText(RowResult::Status status);
/// The status of this name; that of a failure for any other text.
RowResult::Status StatusOfText(const std::string& text);

/// Runs the description whose serialized bytes these are, in this process, and keeps its log at
/// `log` unless that is empty.
RowResult RunForRow(const std::string& description, const std::string& log);

/// The same, with its messages in a record, which can be read once this is over.
RowResult RunForRow(const std::string& description, const RunRecord& record);

/// What `run --json` says of a run, as far as it is no list and depends on the inputs alone: by
/// names with points in them, such as `gait.forward_m`; of vectors the names end in north, up and
/// east. One that is not known is null.
Json FlatFigures(const RunSummary& summary);

/// A figure of such an object by its name; null where what it belongs to is null, as all of `gait`
/// for a run without one. Nothing if there is none of that name.
std::optional<Json> FigureOf(const Json& figures, const std::string& name);

/// The names before the first point that figures can have, to find a misspelt one before a run.
std::vector<std::string> FigureGroups();

}  // namespace morphbus::tools
