// Any bytes as the log of a run: loaded as far as it is sound, or refused with a message.

#include <cstdint>
#include <string>

#include "logger/log/run_log.h"
#include "test/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const morphbus::test::MemoryFile file(data, size);
  const auto log = morphbus::logger::LoadRunLog(file.path());
  if (!log && log.error().message.empty()) __builtin_trap();
  return 0;
}
