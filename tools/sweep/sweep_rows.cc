#include "tools/sweep/sweep_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "compiler/base/split_mix.h"
#include "compiler/base/text.h"
#include "tools/launch/launcher_link.h"
#include "tools/sweep/best_rows.h"
#include "tools/sweep/sweep_estimate.h"

namespace morphbus::tools {
namespace {

/// How long a result may wait to be written to the disk, s: for every row alone the disk would have
/// to be waited for.
constexpr double kCommitSeconds = 0.25;

}  // namespace

void StoredRows::Append(const StoredRow& row, const std::string& log) {
  waiting_.push_back({row.place, row.key, log});
  ++rows_;
}

Result<std::optional<RowTask>> StoredRows::Next() {
  if (waiting_.empty() || CaughtSignal() != 0) return std::optional<RowTask>();
  Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  Result<RowInputs> inputs = store_.InputsOf(next.key);
  if (!inputs) return Fail(inputs.error().message);
  return std::optional(RowTask{next.place, next.key, std::move(*inputs), next.log});
}

bool StoredRows::GoOn() {
  // By the rows that are done, which need not be like those that are left.
  const double rate = static_cast<double>(taken_) / std::max(timer_.seconds(), 1e-3);
  const std::string left =
      taken_ == 0 ? ""
                  : fmt::format(", {:.2g} a second, {} left", rate,
                                DurationText(static_cast<double>(rows_ - taken_) / rate));
  progress_.Show(fmt::format("{}{} of {}{}", label_, taken_, Counted(rows_, "row"), left),
                 rows_ == 0 ? 1.0 : static_cast<double>(taken_) / static_cast<double>(rows_));
  return CaughtSignal() == 0;
}

Result<std::unique_ptr<MissingRows>> MissingRows::Of(SweepStore* store, int64_t from) {
  std::unique_ptr<MissingRows> rows(new MissingRows(store));
  std::set<std::string> keys;
  const Result<void> read = store->EachRow(
      [&](const StoredRow& row) {
        // Rows of equal inputs share one result.
        if (!row.result && keys.insert(row.key).second) rows->Append(row);
        return true;
      },
      from);
  if (!read) return Fail(read.error().message);
  return rows;
}

Result<void> MissingRows::Take(const RowTask& task, const RowResult& result) {
  CountTaken();
  // What is lost with this process is run again, so that the disk need not have it at once.
  Result<void> added = store_.Add(task.key, result);
  if (!added || since_commit_.seconds() < kCommitSeconds) return added;
  since_commit_ = WallTimer();
  return store_.Commit();
}

bool MissingRows::GoOn() {
  // Rows that take minutes do not wait for the next one to be written.
  if (committed_ && since_commit_.seconds() >= kCommitSeconds) {
    since_commit_ = WallTimer();
    committed_ = store_.Commit();
  }
  return StoredRows::GoOn() && committed_;
}

Result<void> MissingRows::Settle() { return committed_ ? store_.Commit() : committed_; }

void RepeatedRows::Add(const StoredRow& row, const std::string& log) {
  Append(row, log);
  repeats_[row.place] = {row.place, *row.result, {}, log};
}

Result<void> RepeatedRows::Take(const RowTask& task, const RowResult& result) {
  CountTaken();
  repeats_[task.place].now = result;
  done_.insert(task.place);
  return {};
}

std::vector<RowRepeat> RepeatedRows::Repeats() const {
  std::vector<RowRepeat> repeats;
  for (const int64_t place : done_) repeats.push_back(repeats_.at(place));
  return repeats;
}

Result<void> AddSample(SweepStore* store, double share, uint64_t seed, RepeatedRows* rows) {
  // A row is drawn by its own number, whatever the others are.
  std::optional<StoredRow> first;
  const Result<void> read = store->EachRow([&](const StoredRow& row) {
    if (!row.result || row.result->status != RowResult::Status::kRan) return true;
    if (!first) first = row;
    SplitMix64 random(SplitMix64::Mix(seed) ^ static_cast<uint64_t>(row.place));
    if (random.NextFraction() < share) rows->Add(row);
    return true;
  });
  // A small share of few rows may be none.
  if (read && rows->rows() == 0 && first) rows->Add(*first);
  return read;
}

Result<void> AddKept(SweepStore* store, const SweepKeep& keep, const std::string& folder,
                     RepeatedRows* rows) {
  std::vector<StoredRow> kept;
  if (keep.by) {
    Result<std::vector<RankedRow>> best = BestRows(store, *keep.by, keep.smallest, keep.best);
    if (!best) return Fail("keep: " + best.error().message);
    for (RankedRow& one : *best) kept.push_back(std::move(one.row));
  }
  const Result<void> read = store->EachRow([&](const StoredRow& row) {
    const bool failed = row.result && row.result->status != RowResult::Status::kRan;
    if (keep.failed && failed) kept.push_back(row);
    return true;
  });
  if (!read) return read;
  std::ranges::sort(kept, {}, &StoredRow::place);
  // The key in the name tells a row of this plan from that of an earlier one in its place.
  for (const StoredRow& row : kept) {
    const std::string log =
        fmt::format("{}/row-{}-{}.log", folder, row.place, row.key.substr(0, 8));
    std::error_code unknown;
    if (!std::filesystem::exists(log, unknown)) rows->Add(row, log);
  }
  return {};
}

}  // namespace morphbus::tools
