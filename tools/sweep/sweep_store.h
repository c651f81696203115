#pragma once
// The rows of a sweep in one SQLite file: what each is told, what it takes to run it, and how its
// run went. docs/sweep.md describes the tables.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/base/descriptor.h"
#include "tools/sweep/row_run.h"
#include "tools/sweep/sweep_plan.h"

struct sqlite3;
struct sqlite3_stmt;

namespace morphbus::tools {

/// A row of a stored plan, with its result if it has one.
struct StoredRow {
  /// From 1.
  int64_t place = 0;
  std::string key;
  RunPoint point;
  std::optional<RowResult> result;
};

/// What a plan was made of.
struct SweepOrigin {
  /// That of the sweep's file, absolute.
  std::string folder;
  /// The file's text, and what the command line laid over it.
  std::string text;
  std::vector<std::string> words;
};

/// How many rows of the plan are in which state.
struct RowCounts {
  int64_t rows = 0, done = 0, failed = 0, crashed = 0, timeout = 0;
  /// Results of rows that earlier plans had.
  int64_t others = 0;
  [[nodiscard]] int64_t missing() const { return rows - done - failed - crashed - timeout; }
};

/// One database. Each change is a transaction: whoever kills this process at whatever moment leaves
/// whole rows. One process at a time writes.
class SweepStore {
 public:
  /// Opens the database of `path` for writing, and makes it if there is none or an empty file.
  /// Fails if the file is something else, of a newer version, cut or damaged, or somebody else
  /// writes it; the error says what to do.
  static Result<std::unique_ptr<SweepStore>> OpenToWrite(const std::string& path);
  /// The same for reading, of a database that is there.
  static Result<std::unique_ptr<SweepStore>> OpenToRead(const std::string& path);
  ~SweepStore();
  SweepStore(const SweepStore&) = delete;
  SweepStore& operator=(const SweepStore&) = delete;

  /// Stores the plan in the place of the one before. Results stay, by their keys, and serve the new
  /// plan. `origin` says what it was made of.
  Result<void> SetPlan(const SweepPlan& plan, const SweepOrigin& origin);
  /// Adds rows behind those of the plan.
  Result<void> Extend(const SweepPlan& more);
  /// What SetPlan was given last.
  Result<SweepOrigin> Origin();

  /// Calls `each` for the rows of the plan in order, from this place on, until it returns false.
  Result<void> EachRow(const std::function<bool(const StoredRow&)>& each, int64_t from = 1);
  /// The row at a place; nothing if the plan has none there.
  Result<std::optional<StoredRow>> RowAt(int64_t place);
  Result<RowCounts> Counts();
  /// The inputs of the row with this key.
  Result<RowInputs> InputsOf(const std::string& key);
  /// The bytes of a part.
  Result<std::string> Part(const std::string& hash);
  /// The serialized description of the row with this key: its parts and its own.
  Result<std::string> DescriptionOf(const std::string& key);

  /// Adds a result, or puts it in the place of the row's earlier one. Written to the disk at
  /// the next Commit.
  Result<void> Add(const std::string& key, const RowResult& result);
  /// Forgets the results of the rows of the plan that are not done.
  Result<void> ForgetFailed();
  /// Makes what was added last.
  Result<void> Commit();

  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  class Statement;
  explicit SweepStore(std::string path) : path_(std::move(path)) {}
  Result<void> Open(bool write);
  Result<void> CheckFormat(bool write);
  Result<void> Run(const char* sql);
  /// The database's last error as a sentence for people.
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& doing) const;
  Result<std::optional<std::string>> Meta(const char* name);
  /// Adds rows, of which the first one has this number.
  Result<void> PutRows(const SweepPlan& plan, int64_t number);
  Result<void> DropUnused();

  std::string path_;
  /// Held while this process writes. It is closed after the database: closing any descriptor of the
  /// file drops SQLite's own locks.
  std::optional<Descriptor> lock_;
  sqlite3* db_ = nullptr;
  bool in_transaction_ = false;
};

}  // namespace morphbus::tools
