#pragma once
// Rows on their way to the process that runs them, and results on their way back: lines of JSON
// over a socket. They hold all that the runs need, so that nothing but the program has to be where
// they run.
//
//     {"chunk":1,"version":"0.1.0-…"}
//     {"part":"HASH","bytes":"BASE64"}                                 (what rows share)
//     {"row":7,"key":"KEY","parts":["HASH",…],"own":"BASE64","log":""}
//
// and for each row
//
//     {"row":7,"key":"KEY","status":"done","hash":"…","figures":{…},"error":"","seconds":0.3,…}

#include <map>
#include <optional>
#include <string>
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

/// A result that was read.
struct PlacedResult {
  int64_t place = 0;
  std::string key;
  RowResult result;
};
/// Reads the line of a result. Fails if it is none.
Result<PlacedResult> ReadResult(const std::string& line);

/// Runs the rows of a chunk, line by line.
class ChunkRunner {
 public:
  /// Takes a line; a row is run, and its result's line returned. Fails if the line makes no sense,
  /// or if another version of the program wrote it, whose runs may have other hashes.
  Result<std::optional<std::string>> Take(const std::string& line);

 private:
  Result<std::optional<std::string>> TakeObject(const Json& json);
  Result<RowTask> ReadTask(const Json& json);

  bool begun_ = false;
  /// Those of the row before and what came since; what the next row does not name is dropped, so
  /// that memory does not grow.
  std::map<std::string, std::string> parts_;
};

}  // namespace morphbus::tools
