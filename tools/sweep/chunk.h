#pragma once
// Rows on their way to the process that runs them, and results on their way back: lines of JSON
// over a socket, over ssh or in a file. They hold all that the runs need, so that nothing but the
// program has to be where they run.
//
//     {"chunk":2,"version":"0.1.0-…","arithmetic":"8d43…"}
//     {"part":"HASH","bytes":"BASE64"}                                 (what rows share)
//     {"row":7,"key":"KEY","parts":["HASH",…],"own":"BASE64","log":""}
//
// and for each row
//
//     {"row":7,"key":"KEY","status":"done","hash":"…","figures":{…},"error":"","seconds":0.3,…}

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/sweep/row_run.h"
#include "tools/sweep/sweep_plan.h"

namespace morphbus::tools {

/// A row to be run.
struct RowTask {
  int64_t place = 0;
  std::string key;
  RowInputs inputs;
  /// Where its log is kept; empty: nowhere.
  std::string log;
};

/// The first line of a chunk, a part, a row, and a result; each with its line feed.
std::string ChunkLine();
std::string PartLine(const std::string& hash, const std::string& bytes);
std::string RowLine(const RowTask& task);
std::string ResultLine(int64_t place, const std::string& key, const RowResult& result);

/// Nothing if a build of this version and with this fingerprint of its arithmetic has the same rows
/// as this one; else what is different, as "it is morphbus 0.1.0, this is 0.2.0".
std::string BuildDifference(const std::string& version, const std::string& arithmetic);

/// A result that was read.
struct PlacedResult {
  int64_t place = 0;
  std::string key;
  RowResult result;
};
/// Reads the line of a result. Fails if it is none.
Result<PlacedResult> ReadResult(const std::string& line);

/// Which parts the reader of a chunk holds: those that its rows have named last, so that a part is
/// written once though rows take turns with it, and memory does not grow. Whoever writes a chunk
/// keeps the same list.
class HeldParts {
 public:
  using Bytes = std::shared_ptr<const std::string>;
  /// The bytes of a part; nothing if it is not held.
  [[nodiscard]] std::optional<Bytes> Find(const std::string& hash) const;
  void Put(const std::string& hash, Bytes bytes);
  /// A row names these. Those that no row has named for long are dropped.
  void Use(const std::vector<std::string>& hashes);

 private:
  /// What was named last is the last.
  std::vector<std::pair<std::string, Bytes>> parts_;
};

/// Writes a chunk, row by row.
class ChunkWriter {
 public:
  /// The lines that hand a row over: with the first row that of the chunk, then the parts that the
  /// reader does not hold, whose bytes `part` has, and the row. Fails as `part` does.
  Result<std::string> LinesOf(const RowTask& task,
                              const std::function<Result<std::string>(const std::string&)>& part);

 private:
  bool begun_ = false;
  HeldParts held_;
};

/// A row that was read, with its parts.
struct ChunkRow {
  RowTask task;
  std::map<std::string, HeldParts::Bytes> parts;
};

/// Reads a chunk, line by line.
class ChunkReader {
 public:
  /// Takes a line; gives a row if it is one. Fails if the line makes no sense, or if a build wrote
  /// it whose runs may have other hashes.
  Result<std::optional<ChunkRow>> Take(const std::string& line);

 private:
  Result<std::optional<ChunkRow>> TakeObject(const Json& json);

  bool begun_ = false;
  HeldParts held_;
};

/// Runs the rows of a chunk, line by line.
class ChunkRunner {
 public:
  /// Takes a line; a row is run, and its result's line returned. Fails as ChunkReader does.
  Result<std::optional<std::string>> Take(const std::string& line);

 private:
  ChunkReader reader_;
};

}  // namespace morphbus::tools
