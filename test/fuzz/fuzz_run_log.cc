// Any bytes as the log of a run: loaded as far as it is sound, or refused with a message.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "logger/run_log.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const int fd = memfd_create("log", MFD_CLOEXEC);
  if (fd < 0) return 0;
  size_t written = 0;
  while (written < size) {
    const ssize_t n = write(fd, data + written, size - written);
    if (n <= 0) break;
    written += static_cast<size_t>(n);
  }
  const auto log = morphbus::logger::LoadRunLog("/proc/self/fd/" + std::to_string(fd));
  if (!log && log.error().message.empty()) __builtin_trap();
  close(fd);
  return 0;
}
