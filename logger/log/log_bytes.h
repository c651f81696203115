#pragma once
// Where the bytes of a log come from: a file as LCM writes it, or one that was compressed with zstd
// afterwards (x.log.zst). The reader of events sees the same bytes either way.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "compiler/base/result.h"

namespace morphbus::logger {

/// Something wrong with the compression of a log, which the events themselves cannot tell.
struct CompressionFinding {
  /// Byte of the decompressed log at which it shows.
  uint64_t offset = 0;
  /// True if the compressed file ends too early, false if something in it is wrong.
  bool truncated = false;
  std::string what;  ///< One sentence for people, with the bytes of the compressed file.
};

/// The bytes of one log, by their offsets in the log as it was recorded. They are read mostly
/// forwards; a compressed log that is read backwards, to before what Forget() allowed it to drop,
/// is decompressed again from its beginning.
class LogBytes {
 public:
  /// Opens a regular file; a pipe or device is refused at once. A file is a compressed one if it
  /// begins with a frame of zstd, whatever its name.
  static Result<std::unique_ptr<LogBytes>> Open(const std::string& path);
  virtual ~LogBytes() = default;
  LogBytes(const LogBytes&) = delete;
  LogBytes& operator=(const LogBytes&) = delete;

  /// Copies up to `size` bytes at `offset` into `out`; returns how many there were.
  virtual size_t ReadAt(uint64_t offset, uint8_t* out, size_t size) = 0;
  /// How many bytes the log has at least: `wanted` or more if it has so many, else all of them.
  virtual uint64_t Extend(uint64_t wanted) = 0;
  /// Bytes before `offset` are not needed for now, and may leave the memory.
  virtual void Forget(uint64_t offset) = 0;

  /// What is wrong with the compression, in order; the reader takes them off the front.
  [[nodiscard]] std::deque<CompressionFinding>& findings() { return findings_; }
  /// Size of the file on the disk when it was opened, bytes.
  [[nodiscard]] uint64_t file_size() const { return file_size_; }
  /// Bytes of the file that have been taken so far, for progress.
  [[nodiscard]] virtual uint64_t file_bytes_read() const = 0;
  [[nodiscard]] bool compressed() const { return compressed_; }
  /// Set if the operating system could not read the file to its end.
  [[nodiscard]] const std::string& io_error() const { return io_error_; }

 protected:
  LogBytes(bool compressed, uint64_t file_size) : compressed_(compressed), file_size_(file_size) {}

  bool compressed_;
  uint64_t file_size_;
  std::string io_error_;
  std::deque<CompressionFinding> findings_;
};

/// True if `path` is a regular file that begins as a log does, compressed or not. A pipe is not
/// looked into: its bytes would be missed.
bool BeginsAsLog(const std::string& path);

}  // namespace morphbus::logger
