// Any bytes as a log file, plain or compressed: the reader finds its end, reports damage, and never
// yields an event that does not lie in the log.

#include <cstdint>
#include <string>

#include "logger/log/event_log.h"
#include "test/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const morphbus::test::MemoryFile file(data, size);
  const auto reader = morphbus::logger::EventLogReader::Open(file.path());
  if (reader) {
    morphbus::logger::LogEvent event;
    uint64_t last_end = 0;
    uint64_t covered = 0;
    while ((*reader)->Next(&event)) {
      const uint64_t end = event.offset + morphbus::logger::kEventHeaderBytes +
                           event.channel.size() + event.data.size();
      if (event.offset < last_end || end > (*reader)->log_size()) __builtin_trap();
      covered += end - event.offset;
      last_end = end;
    }
    // Whatever is no event must have been reported.
    if (covered != (*reader)->log_size() && !(*reader)->damaged()) __builtin_trap();
    if (!(*reader)->compressed() && (*reader)->log_size() != size) __builtin_trap();
  }
  return 0;
}
