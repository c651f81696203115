#pragma once
// The rows of a stored sweep on their way through an engine: those that are missing, those that are
// to be run again for a check, and those whose logs are kept.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tools/base/work_progress.h"
#include "tools/machine/wall_clock.h"
#include "tools/sweep/row_source.h"
#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// Rows of a store one after the other, with a line of progress on a terminal; a signal stops it.
class StoredRows : public RowSource {
 public:
  Result<std::optional<RowTask>> Next() override;
  Result<RowInputs> Inputs(const std::string& key) override { return store_.InputsOf(key); }
  Result<std::string> Part(const std::string& hash) override { return store_.Part(hash); }
  bool GoOn() override;
  /// What stands before the progress, as "generation 3 of 30, ".
  void set_label(std::string label) { label_ = std::move(label); }
  /// Results that have come, and rows in all.
  [[nodiscard]] int64_t taken() const { return taken_; }
  [[nodiscard]] int64_t rows() const { return rows_; }

 protected:
  explicit StoredRows(SweepStore* store) : store_(*store) {}
  /// Appends a row; its log is kept there unless that is empty.
  void Append(const StoredRow& row, const std::string& log = "");
  void CountTaken() { ++taken_; }

  SweepStore& store_;

 private:
  struct Waiting {
    int64_t place;
    std::string key;
    std::string log;
  };
  std::deque<Waiting> waiting_;
  int64_t rows_ = 0, taken_ = 0;
  std::string label_;
  WallTimer timer_;
  WorkProgress progress_;
};

/// The rows without a result, each of equal ones once. Results go into the store, and to the disk
/// some times a second.
class MissingRows : public StoredRows {
 public:
  /// Finds them, from a place on. Fails if the store cannot be read.
  static Result<std::unique_ptr<MissingRows>> Of(SweepStore* store, int64_t from = 1);
  Result<void> Take(const RowTask& task, const RowResult& result) override;
  /// Writes what has not been written yet. The first error of GoOn comes here, too.
  Result<void> Settle() override;
  bool GoOn() override;

 private:
  explicit MissingRows(SweepStore* store) : StoredRows(store) {}
  WallTimer since_commit_;
  Result<void> committed_;
};

/// A row that was run again.
struct RowRepeat {
  int64_t place = 0;
  RowResult before, now;
  std::string log;
  /// Whether status, hash and figures are the same.
  [[nodiscard]] bool same() const {
    return before.status == now.status && before.hash == now.hash && before.figures == now.figures;
  }
};

/// Rows that are run again; the store stays as it is.
class RepeatedRows : public StoredRows {
 public:
  explicit RepeatedRows(SweepStore* store) : StoredRows(store) {}
  /// Adds a row that has a result.
  void Add(const StoredRow& row, const std::string& log = "");
  Result<void> Take(const RowTask& task, const RowResult& result) override;
  /// In order of their places, once all have been run.
  [[nodiscard]] std::vector<RowRepeat> Repeats() const;

 private:
  std::map<int64_t, RowRepeat> repeats_;
  std::set<int64_t> done_;
};

/// Adds to `rows` a share (0…1) of the rows that are done, drawn with a seed; at least one if there
/// is one.
Result<void> AddSample(SweepStore* store, double share, uint64_t seed, RepeatedRows* rows);

/// Adds to `rows` those whose logs are to be kept (keep = …) and are not there yet. Logs lie in the
/// folder `folder`, named by row and key.
Result<void> AddKept(SweepStore* store, const SweepKeep& keep, const std::string& folder,
                     RepeatedRows* rows);

}  // namespace morphbus::tools
