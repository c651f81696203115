#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "tools/base/descriptor.h"

namespace morphbus::tools {

/// Where the logger of a run puts its messages, and what is read of them when the run is over: a
/// log, or, for a run that leaves none (`run --no-log`), memory that goes with this object. Both
/// hold the same bytes, so that all that is told of a run is the same.
class RunRecord {
 public:
  /// A log of this path, which has the name PATH.partial while it is written. Nothing is opened.
  // NOLINTNEXTLINE(google-explicit-constructor): a path is meant wherever one is given.
  RunRecord(std::string path) : path_(std::move(path)) {}
  /// The same, and whether it can be written is found out before anything starts. Empty, after
  /// saying why, if it cannot, or would take the place of one of `inputs` or, without `force`, of a
  /// file that is no log. `path` is absolute.
  static std::optional<RunRecord> ToLog(const std::string& path, bool force,
                                        const std::vector<std::string>& inputs);
  /// A file without a name, in memory. Fails if the kernel makes none.
  static Result<RunRecord> InMemory();

  /// Where it can be read once it is whole; the same in a process that inherits fd().
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Where it is while it is written, or after its writer failed.
  [[nodiscard]] std::string partial_path() const {
    return in_memory() ? path_ : path_ + ".partial";
  }
  [[nodiscard]] bool in_memory() const { return fd_.get() >= 0; }
  /// The memory's descriptor; -1 for a log.
  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  RunRecord(std::string path, Descriptor fd) : path_(std::move(path)), fd_(std::move(fd)) {}

  std::string path_;
  Descriptor fd_;
};

}  // namespace morphbus::tools
