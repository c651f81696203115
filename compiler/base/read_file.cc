#include "compiler/base/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <system_error>

#include "compiler/base/quantity.h"

namespace morphbus {
namespace {

/// Why a path that is open as `fd` is not read; empty if it may be.
std::string WhyNotRead(const std::string& path, int fd) {
  struct stat info = {};
  if (fstat(fd, &info) != 0) return std::strerror(errno);
  // A stream that the user's shell has opened for us, such as /dev/stdin, may be a pipe or a
  // terminal.
  if (S_ISREG(info.st_mode) || OwnDescriptor(path)) return "";
  if (!S_ISFIFO(info.st_mode)) return "not a regular file";
  return "not a regular file but a named pipe, which nobody may ever write to: give a file, "
         "/dev/stdin, or <(command)";
}

/// Reads to the end, or one byte beyond the limit.
Result<std::string> ReadToEnd(int fd, size_t limit) {
  std::string bytes;
  char buffer[1 << 16];
  // The size that fstat tells is not asked: pipes have none, and a file may grow meanwhile.
  while (bytes.size() <= limit) {
    const ssize_t got = read(fd, buffer, sizeof buffer);
    if (got < 0) return Fail(std::strerror(errno));
    if (got == 0) break;
    bytes.append(buffer, static_cast<size_t>(got));
  }
  return bytes;
}

/// A size in the largest unit that divides it.
std::string SizeText(size_t bytes) {
  constexpr size_t kMiB = size_t{1} << 20;
  return bytes % kMiB == 0 ? std::to_string(bytes / kMiB) + " MiB"
                           : std::to_string(bytes) + " bytes";
}

/// The content of what is opened at `path`.
Result<std::string> ReadOpened(const std::string& path, size_t limit) {
  // Opened so, a pipe without a writer does not wait for one; it is looked at first.
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return Fail(errno == ENOENT ? "no such file" : std::strerror(errno));
  const std::string why = WhyNotRead(path, fd);
  // A stream is waited for, as every program that reads one does.
  if (why.empty()) fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  Result<std::string> bytes = why.empty() ? ReadToEnd(fd, limit) : Fail(why);
  close(fd);
  if (bytes && bytes->size() > limit) return Fail("larger than " + SizeText(limit));
  return bytes;
}

}  // namespace

std::optional<int> OwnDescriptor(const std::string& path) {
  // The same name may be written in several ways, such as //dev/stdout.
  const std::string plain = std::filesystem::path(path).lexically_normal().string();
  if (plain == "/dev/stdin") return STDIN_FILENO;
  if (plain == "/dev/stdout") return STDOUT_FILENO;
  if (plain == "/dev/stderr") return STDERR_FILENO;
  for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!plain.starts_with(folder)) continue;
    // The whole rest of the name must be a number: /dev/fd/1x is an ordinary path.
    const auto number = ReadNumber<int>(std::string_view(plain).substr(folder.size()));
    if (number && *number >= 0) return number;
  }
  return std::nullopt;
}

Result<std::string> ReadWholeFile(const std::string& path, size_t limit) {
  const std::optional<int> stream = OwnDescriptor(path);
  if (!stream) return ReadOpened(path, limit);
  // A pipe gives its bytes once, and a program's text is read to compile and again to quote it.
  static std::mutex guard;
  static std::map<int, std::string> read;
  const std::lock_guard<std::mutex> lock(guard);
  if (const auto known = read.find(*stream); known != read.end()) return known->second;
  Result<std::string> bytes = ReadOpened(path, limit);
  if (bytes) read[*stream] = *bytes;
  return bytes;
}

}  // namespace morphbus
