#include "tools/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace morphbus::tools {

Result<std::string> ReadFile(const std::string& path, size_t limit) {
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

Result<void> WriteFile(const std::string& path, const std::string& bytes) {
  if (path == "-") {
    std::fwrite(bytes.data(), 1, bytes.size(), stdout);
    if (std::fflush(stdout) != 0) return Fail("cannot write to standard output");
    return {};
  }
  std::string temporary = path + ".XXXXXX";
  const int fd = mkostemp(temporary.data(), O_CLOEXEC);
  if (fd < 0) return Fail(fmt::format("cannot write {}: {}", path, std::strerror(errno)));
  const mode_t mask = umask(0);
  umask(mask);
  bool good = fchmod(fd, 0666 & ~mask) == 0;
  for (size_t done = 0; good && done < bytes.size();) {
    const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
    good = n > 0 || (n < 0 && errno == EINTR);
    if (n > 0) done += static_cast<size_t>(n);
  }
  good = good && fsync(fd) == 0;
  const int reason = errno;
  if (close(fd) == 0 && good && std::rename(temporary.c_str(), path.c_str()) == 0) return {};
  const int cause = good ? errno : reason;
  unlink(temporary.c_str());
  return Fail(fmt::format("cannot write {}: {}", path, std::strerror(cause)));
}

}  // namespace morphbus::tools
