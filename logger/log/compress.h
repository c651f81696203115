#pragma once
// A log compressed after the fact, so that every tool still reads it (LogBytes).

#include <cstdint>
#include <string>

#include "logger/log/byte_sink.h"

namespace morphbus::logger {

/// What CompressLog() did, in bytes.
struct CompressionReport {
  uint64_t log_bytes = 0;
  uint64_t compressed_bytes = 0;
};

/// Compresses the log at `path` with zstd, into frames of some 4 MiB that begin where an event does
/// and end with a checksum of their content. So a wrong byte of the compressed file costs at most
/// one frame, where `zstd x.log` makes one frame of all. `zstd -d` gives back the same bytes, also
/// those of a damaged log. Fails if the log cannot be read to its end, or as `write` does.
Result<CompressionReport> CompressLog(const std::string& path, const ByteSink& write);

}  // namespace morphbus::logger
