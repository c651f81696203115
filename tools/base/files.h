#pragma once
// Files whole: read with a limit, written so that there is never half of one.

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/base/temporary_files.h"

namespace morphbus::tools {

/// The whole content of a file of at most `limit` bytes (ReadWholeFile); the error names it.
Result<std::string> ReadFile(const std::string& path, size_t limit = size_t{1} << 30);
/// Writes a file whole (OutputFile).
Result<void> WriteFile(const std::string& path, const std::string& bytes);

/// A file that is written piece by piece under a temporary name beside its own, synced and renamed,
/// so that it is never half a file. A file that was there keeps its permissions, a symbolic link
/// stays one (its target is written, also where that was not there), a pipe, a device or a stream
/// such as /dev/stdout is written to as it is. Path "-" is stdout. Errors name the path and the
/// reason.
class OutputFile {
 public:
  /// Opens the temporary file, or the stream.
  static Result<std::unique_ptr<OutputFile>> Create(const std::string& path);
  /// Removes the temporary file, unless Close() came first: what was there stays as it was. A
  /// signal that ends the process does so, too.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends bytes, through a buffer of 1 MiB.
  Result<void> Write(std::span<const uint8_t> bytes);
  Result<void> Write(std::string_view text);
  /// The temporary file, for a program that writes it in the place of Write(). -1 for a stream,
  /// which has none.
  [[nodiscard]] int file() const { return kind_ == Kind::kFile ? fd_ : -1; }
  /// Writes what waits, and gives the file its name. Nothing can be written after.
  Result<void> Close();

 private:
  /// How the bytes go out.
  enum class Kind { kStdout, kDescriptor, kDevice, kFile };

  OutputFile(std::string path, Kind kind, int fd) : path_(std::move(path)), kind_(kind), fd_(fd) {}
  /// Hands the buffer to the operating system.
  Result<void> Flush();

  /// As the user wrote it.
  std::string path_;
  Kind kind_;
  int fd_;  ///< -1 for stdout, which goes through stdio so that it comes after what was printed.
  /// Of a file: its own name, links followed, and that until Close().
  std::string target_;
  std::optional<TemporaryPath> temporary_;
  std::vector<uint8_t> buffer_;
};

}  // namespace morphbus::tools
