#pragma once
// What runs on this machine: a private directory a run, locked by its launcher for as long as it
// lives.

#include <sys/types.h>

#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::tools {

/// What others need to know about a run. The launcher publishes it as JSON in the run's directory;
/// `morphbus runs` and --run read it from there.
struct RunEntry {
  /// The run's name, which is also that of its directory.
  std::string name;
  pid_t pid = 0;      ///< Of the launcher.
  std::string since;  ///< Wall time, ISO 8601.
  /// The robot's name; "(replay)" for the private network of a replay.
  std::string robot;
  std::string log;  ///< Absolute path; empty if none is written.
  std::string url;  ///< LCM URL of its bus; empty for a run in one process.
  /// Whether the run has a private network, which others must join to hear it.
  bool isolated = false;
  /// The run's directory, absolute; known to who reads the entry.
  std::string folder = {};
};

/// The directory of one run, mode 0700, under $XDG_RUNTIME_DIR/morphbus or /tmp/morphbus-<uid>.
/// It and its content vanish with the object; what a killed launcher leaves is removed by ListRuns.
class RunDirectory {
 public:
  /// Claims `name` (or a fresh short name if empty): creates its directory and locks it. Fails if
  /// the name is not usable in channel names, if a living run holds it, or if the registry's folder
  /// is not private to this user.
  static Result<RunDirectory> Claim(const std::string& name);

  RunDirectory(RunDirectory&& other) noexcept;
  RunDirectory& operator=(RunDirectory&&) = delete;
  RunDirectory(const RunDirectory&) = delete;
  RunDirectory& operator=(const RunDirectory&) = delete;
  ~RunDirectory();

  /// The name that was claimed: the given one, or a fresh one.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// The directory, absolute.
  [[nodiscard]] const std::string& path() const { return path_; }

  /// Lets `morphbus runs` and `--run` see the run. Fails if the entry cannot be written.
  Result<void> Publish(const RunEntry& entry) const;

 private:
  RunDirectory(std::string name, std::string path, int lock)
      : name_(std::move(name)), path_(std::move(path)), lock_(lock) {}

  std::string name_;
  /// It is removed with all that is in it by the destructor of the object that holds the lock.
  std::string path_;
  int lock_ = -1;  ///< Descriptor of the locked file; the lock goes with the process.
};

/// The living runs, in order of name. Removes what dead ones left behind: the directories whose
/// lock nobody holds. A run that has claimed its name but published nothing yet is left out.
Result<std::vector<RunEntry>> ListRuns();

/// The living run called `name`; if that is empty the only one, or the only one that has a bus.
/// Fails if there is none, or several and no name; the error lists what there is.
Result<RunEntry> FindRun(const std::string& name);

/// Wall time now as ISO 8601 with the zone, for people.
std::string WallTime();

}  // namespace morphbus::tools
