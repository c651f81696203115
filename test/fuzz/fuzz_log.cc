// Any bytes as a log file: the reader finds its end, reports damage, and never yields an event that
// does not lie in the file.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "logger/event_log.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const int fd = memfd_create("log", MFD_CLOEXEC);
  if (fd < 0) return 0;
  size_t written = 0;
  while (written < size) {
    const ssize_t n = write(fd, data + written, size - written);
    if (n <= 0) break;
    written += static_cast<size_t>(n);
  }
  const auto reader = morphbus::logger::EventLogReader::Open("/proc/self/fd/" + std::to_string(fd));
  if (reader) {
    morphbus::logger::LogEvent event;
    uint64_t last_end = 0;
    uint64_t covered = 0;
    while ((*reader)->Next(&event)) {
      const uint64_t end = event.offset + morphbus::logger::kEventHeaderBytes +
                           event.channel.size() + event.data.size();
      if (event.offset < last_end || end > size) __builtin_trap();
      covered += end - event.offset;
      last_end = end;
    }
    // Whatever is no event must have been reported.
    if (covered != size && !(*reader)->damaged()) __builtin_trap();
  }
  close(fd);
  return 0;
}
