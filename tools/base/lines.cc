#include "tools/base/lines.h"

#include <unistd.h>

#include <cerrno>

namespace morphbus::tools {

bool ReadSome(int fd, std::string* buffer) {
  char block[65536];
  ssize_t got = 0;
  do got = read(fd, block, sizeof block);
  while (got < 0 && errno == EINTR);
  // One that does not wait has nothing now, and is not at its end.
  if (got < 0) return errno == EAGAIN;
  buffer->append(block, static_cast<size_t>(got));
  return got > 0;
}

bool WriteWhole(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(fd, text.data(), text.size());
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) text.remove_prefix(static_cast<size_t>(written));
  }
  return true;
}

std::optional<std::string> TakeLine(std::string* buffer) {
  const size_t end = buffer->find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = buffer->substr(0, end);
  buffer->erase(0, end + 1);
  return line;
}

}  // namespace morphbus::tools
