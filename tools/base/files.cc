#include "tools/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>

#include "tools/base/output_path.h"

namespace morphbus::tools {

Result<std::string> ReadFile(const std::string& path, size_t limit) {
  // One byte over the limit is enough to know: a file that is still growing cannot fill the memory.
  std::FILE* file = std::fopen(path.c_str(), "rbe");
  if (file == nullptr) return Fail(fmt::format("cannot open {}: {}", path, std::strerror(errno)));
  std::string bytes;
  char buffer[65536];
  size_t got = 0;
  while (bytes.size() <= limit && (got = std::fread(buffer, 1, sizeof buffer, file)) > 0) {
    bytes.append(buffer, got);
  }
  const bool failed = std::ferror(file) != 0;
  const int reason = errno;
  std::fclose(file);
  if (failed) return Fail(fmt::format("cannot read {}: {}", path, std::strerror(reason)));
  if (bytes.size() > limit) return Fail(fmt::format("{} is over {} bytes", path, limit));
  return bytes;
}

namespace {

/// All of `bytes`; false with errno set if not.
bool WriteAll(int fd, const std::string& bytes) {
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno != EINTR) return false;
    if (n > 0) done += static_cast<size_t>(n);
  }
  return true;
}

/// The error of all that writes: the path as the user wrote it, and the reason of the system.
Result<void> CannotWrite(const std::string& path, int reason) {
  return Fail(fmt::format("cannot write {}: {}", path, std::strerror(reason)));
}

/// Pipes and devices are written to as they are: a file in their place would be no use to anyone.
Result<void> WriteToDevice(const std::string& path, const std::string& bytes) {
  const int fd = open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) return CannotWrite(path, errno);
  const bool good = WriteAll(fd, bytes);
  const int reason = errno;
  if (close(fd) == 0 && good) return {};
  return CannotWrite(path, good ? errno : reason);
}

/// What stdio still holds for it goes first. The descriptor itself is written to, not the file that
/// it may be redirected to: that would start over at the file's first byte.
Result<void> WriteToDescriptor(int fd, const std::string& path, const std::string& bytes) {
  std::fflush(nullptr);
  return WriteAll(fd, bytes) ? Result<void>() : CannotWrite(path, errno);
}

/// Through stdio, so that it comes after what was printed before.
Result<void> WriteToStandardOutput(const std::string& bytes) {
  const bool good = std::fwrite(bytes.data(), 1, bytes.size(), stdout) == bytes.size();
  if (std::fflush(stdout) == 0 && good) return {};
  return CannotWrite("to standard output", errno);
}

/// Permissions of a new file.
mode_t NewFileMode() {
  const mode_t mask = umask(0);
  umask(mask);
  return 0666 & ~mask;
}

}  // namespace

Result<void> WriteFile(const std::string& path, const std::string& bytes) {
  if (path == "-") return WriteToStandardOutput(bytes);
  // A link stays a link: what it points to is replaced, or made.
  const Result<std::string> followed = FollowLinks(path);
  if (!followed) return Fail(followed.error().message);
  const std::string& target = *followed;
  if (const std::optional<int> fd = OwnDescriptor(target)) {
    return WriteToDescriptor(*fd, path, bytes);
  }
  // What is there decides how: a device is written to, a file is replaced and keeps its mode.
  mode_t mode = NewFileMode();
  struct stat old {};
  if (stat(target.c_str(), &old) == 0) {
    if (S_ISDIR(old.st_mode)) return CannotWrite(path, EISDIR);
    if (!S_ISREG(old.st_mode)) return WriteToDevice(target, bytes);
    mode = old.st_mode & 07777;
  }
  // The bytes are on the disk before the name points to them: a crash leaves the old file or the
  // new.
  std::string temporary = target + ".XXXXXX";
  const int fd = mkostemp(temporary.data(), O_CLOEXEC);
  if (fd < 0) return CannotWrite(path, errno);
  const bool good = fchmod(fd, mode) == 0 && WriteAll(fd, bytes) && fsync(fd) == 0;
  const int reason = errno;
  if (close(fd) == 0 && good && std::rename(temporary.c_str(), target.c_str()) == 0) return {};
  const int cause = good ? errno : reason;
  unlink(temporary.c_str());
  return CannotWrite(path, cause);
}

}  // namespace morphbus::tools
