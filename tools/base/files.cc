#include "tools/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

#include "compiler/base/read_file.h"
#include "tools/base/lines.h"
#include "tools/base/output_path.h"
#include "tools/base/print.h"

namespace morphbus::tools {

Result<std::string> ReadFile(const std::string& path, size_t limit) {
  Result<std::string> bytes = ReadWholeFile(path, limit);
  if (!bytes) return Fail(fmt::format("cannot read {}: {}", path, bytes.error().message));
  return bytes;
}

namespace {

/// The error of all that writes: the path as the user wrote it, and the reason of the system.
tl::unexpected<Error> CannotWrite(const std::string& path, int reason) {
  return Fail(fmt::format("cannot write {}: {}", path, std::strerror(reason)));
}

/// Permissions of a new file.
mode_t NewFileMode() {
  // The mask can only be read by setting it.
  const mode_t mask = umask(0);
  umask(mask);
  return 0666 & ~mask;
}

/// Bytes that wait in an OutputFile before they are handed on.
constexpr size_t kBufferBytes = size_t{1} << 20;

}  // namespace

Result<std::unique_ptr<OutputFile>> OutputFile::Create(const std::string& path) {
  const auto opened = [&](Kind kind, int fd) {
    return std::unique_ptr<OutputFile>(new OutputFile(path, kind, fd));
  };
  if (path == "-") return opened(Kind::kStdout, -1);
  // A link stays a link: what it points to is replaced, or made.
  const Result<std::string> target = FollowLinks(path);
  if (!target) return Fail(target.error().message);
  // The descriptor itself is written to, not the file that it may be redirected to: that would
  // start over at the file's first byte. What stdio still holds for it goes first.
  if (const std::optional<int> fd = OwnDescriptor(*target)) {
    std::fflush(nullptr);
    return opened(Kind::kDescriptor, *fd);
  }
  // What is there decides how: a device is written to, a file is replaced and keeps its mode.
  mode_t mode = NewFileMode();
  struct stat old {};
  if (stat(target->c_str(), &old) == 0) {
    if (S_ISDIR(old.st_mode)) return CannotWrite(path, EISDIR);
    // Pipes and devices are written to as they are: a file in their place would be no use.
    if (!S_ISREG(old.st_mode)) {
      const int fd = open(target->c_str(), O_WRONLY | O_CLOEXEC);
      if (fd < 0) return CannotWrite(path, errno);
      return opened(Kind::kDevice, fd);
    }
    mode = old.st_mode & 07777;
  }
  // The temporary file lies beside the target, since only within one file system is a rename a
  // single step.
  std::string temporary = *target + ".XXXXXX";
  // A signal between making the file and noting its name would leave it behind.
  const SignalsBlocked blocked;
  const int fd = mkostemp(temporary.data(), O_CLOEXEC);
  const int reason = errno;
  auto file = opened(Kind::kFile, fd);
  if (fd >= 0) file->temporary_.emplace(std::move(temporary));
  if (fd < 0) return CannotWrite(path, reason);
  file->target_ = *target;
  if (fchmod(fd, mode) != 0) return CannotWrite(path, errno);
  return file;
}

OutputFile::~OutputFile() {
  if (fd_ >= 0 && kind_ != Kind::kDescriptor) close(fd_);
}

Result<void> OutputFile::Write(std::span<const uint8_t> bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) {
    if (Result<void> flushed = Flush(); !flushed) return flushed;
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  return buffer_.size() < kBufferBytes ? Result<void>() : Flush();
}

Result<void> OutputFile::Write(std::string_view text) {
  return Write({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

Result<void> OutputFile::Flush() {
  const std::string_view text(reinterpret_cast<const char*>(buffer_.data()), buffer_.size());
  int reason = 0;
  if (kind_ == Kind::kStdout) {
    PrintText(text);
    reason = FlushResult();
  } else if (!WriteWhole(fd_, text)) {
    reason = errno;
  }
  buffer_.clear();
  if (reason == 0) return {};
  return CannotWrite(kind_ == Kind::kStdout ? "to standard output" : path_, reason);
}

Result<void> OutputFile::Close() {
  Result<void> flushed = Flush();
  if (!flushed) return flushed;
  // Descriptors that the process was started with are not its own to close.
  if (kind_ == Kind::kDescriptor || kind_ == Kind::kStdout) return {};
  // The bytes are on the disk before the name points to them: a crash leaves the old file or the
  // new.
  const bool synced = kind_ == Kind::kDevice || fsync(fd_) == 0;
  const int reason = errno;
  const bool closed = close(std::exchange(fd_, -1)) == 0;
  if (!synced || !closed) return CannotWrite(path_, synced ? errno : reason);
  if (kind_ == Kind::kDevice) return {};
  if (std::rename(temporary_->path().c_str(), target_.c_str()) != 0) {
    return CannotWrite(path_, errno);
  }
  temporary_->Keep();
  return {};
}

Result<void> WriteFile(const std::string& path, const std::string& bytes) {
  Result<std::unique_ptr<OutputFile>> file = OutputFile::Create(path);
  if (!file) return tl::unexpected(file.error());
  if (Result<void> written = (*file)->Write(bytes); !written) return written;
  return (*file)->Close();
}

}  // namespace morphbus::tools
