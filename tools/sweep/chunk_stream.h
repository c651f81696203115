#pragma once
// Rows that come as a stream, over ssh: what the other machine does.

#include "tools/sweep/local_engine.h"

namespace morphbus::tools {

/// The first line of the stream back: who runs the rows.
///
///     {"hello":1,"version":"0.1.0-…","arithmetic":"8d43…","jobs":8,"host":"b"}
struct StreamHello {
  std::string version, arithmetic, host;
  /// Processes that run rows.
  int jobs = 1;
};

/// Its line, with its line feed.
std::string HelloLine(int jobs);
/// Reads it. Fails if it is none.
Result<StreamHello> ReadHello(const std::string& line);

/// Says hello on `output`, takes the lines of a chunk from `input` as they come, runs their rows,
/// and writes those of results. The end of `input`, or of whoever reads `output`, ends it. Fails if
/// the lines make no sense or are of another build.
Result<void> ServeStream(int input, int output, const LocalOptions& options);

}  // namespace morphbus::tools
