// Any bytes as the lines between the engines of a sweep and those that run its rows: of a chunk,
// of results, of a hello, and what Slurm's commands print. Refused with a message, or read.

#include <cstdint>
#include <sstream>
#include <string>

#include "tools/sweep/chunk_stream.h"
#include "tools/sweep/engine_settings.h"
#include "tools/sweep/slurm_queue.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace morphbus::tools;
  const std::string text(data, data + size);
  // What this build says about itself is not in a corpus.
  ChunkReader reader;
  if (!reader.Take(ChunkLine())) __builtin_trap();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto row = reader.Take(line);
    if (!row && row.error().message.empty()) __builtin_trap();
    // A row has all of its parts.
    if (row && *row) {
      for (const std::string& hash : (*row)->task.inputs.parts) {
        if ((*row)->parts.at(hash) == nullptr) __builtin_trap();
      }
    }
    if (const auto result = ReadResult(line)) {
      const std::string again = ResultLine(result->place, result->key, result->result);
      if (!ReadResult(again)) __builtin_trap();
    }
    if (const auto hello = ReadHello(line)) {
      if (hello->jobs < 1) __builtin_trap();
    }
    static_cast<void>(HostOfText(line));
  }
  static_cast<void>(ReadQueue(text));
  return 0;
}
