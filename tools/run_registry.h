#pragma once
// What runs on this machine: a private directory a run, locked by its launcher for as long as it
// lives.

#include <sys/types.h>

#include <string>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::tools {

/// What others need to know about a run.
struct RunEntry {
  std::string name;
  pid_t pid = 0;      ///< Of the launcher.
  std::string since;  ///< Wall time, ISO 8601.
  std::string robot;
  std::string log;  ///< Absolute path.
  std::string url;  ///< LCM URL of its bus; empty for a run in one process.
  bool isolated = false;
};

/// The directory of one run, mode 0700, under $XDG_RUNTIME_DIR/morphbus or /tmp/morphbus-<uid>.
/// It and its content vanish with the object; what a killed launcher leaves is removed by ListRuns.
class RunDirectory {
 public:
  /// Claims `name` (or a fresh short name if empty). Fails if the name is not usable in channel
  /// names, or if a living run holds it.
  static Result<RunDirectory> Claim(const std::string& name);

  RunDirectory(RunDirectory&& other) noexcept;
  RunDirectory& operator=(RunDirectory&&) = delete;
  RunDirectory(const RunDirectory&) = delete;
  RunDirectory& operator=(const RunDirectory&) = delete;
  ~RunDirectory();

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& path() const { return path_; }

  /// Lets `morphbus runs` and `--run` see the run.
  Result<void> Publish(const RunEntry& entry) const;

 private:
  RunDirectory(std::string name, std::string path, int lock)
      : name_(std::move(name)), path_(std::move(path)), lock_(lock) {}

  std::string name_;
  std::string path_;
  int lock_ = -1;
};

/// The living runs, in order of name. Removes what dead ones left behind.
Result<std::vector<RunEntry>> ListRuns();

/// The living run called `name`, or the only one if `name` is empty. The error lists what there is.
Result<RunEntry> FindRun(const std::string& name);

/// Wall time now as ISO 8601 with the zone, for people.
std::string WallTime();

}  // namespace morphbus::tools
