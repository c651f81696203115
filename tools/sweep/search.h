#pragma once
// A search under way: generation after generation of candidates, each of which is rows of a sweep.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/sweep/search_file.h"
#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// Settings that were tried, and what came of them.
struct SearchCandidate {
  /// Values of SearchFile::sought; none for the program and model as they are.
  std::vector<Json> values;
  /// A value for each goal, the mean or the worst of the candidate's runs; nothing if one of them
  /// failed or does not have it.
  std::vector<std::optional<double>> goals;
  /// Runs in which a condition did not hold, or a goal is not known.
  int broken = 0;
  /// The first of its rows.
  int64_t row = 0;

  /// Whether it may be chosen.
  [[nodiscard]] bool allowed() const { return broken == 0; }
};

/// The values of its goals as numbers of which less is better. Those of a candidate that must not
/// be chosen are larger than all others, and the larger the more of its runs are broken.
std::vector<double> CostsOf(const SearchFile& search, const SearchCandidate& candidate);

/// What a search has come to so far.
struct SearchOutcome {
  /// As program and model are without it.
  SearchCandidate shipped;
  /// All, in the order in which they were tried.
  std::vector<SearchCandidate> candidates;
  /// Of all starts together.
  int generations = 0;
  /// A signal ended it.
  bool stopped = false;

  /// Those that may be chosen and that no other one is better than, by their indices: of one goal
  /// the best one.
  [[nodiscard]] std::vector<size_t> Best(const SearchFile& search) const;
};

/// Whether a candidate can run at both ends of all ranges that are searched. False after printing
/// why not: a range may go beyond that of a parameter, or hold fractions where it wants an int.
bool CheckRanges(const SearchFile& search);

/// Runs the rows of the store that have no result, from a place on, under a label that says how far
/// the search is. False after saying why, if they cannot be run.
using RunRows = std::function<bool(int64_t from, const std::string& label)>;

/// Searches from the beginning. Rows whose results are in the store are not run again, so that a
/// search that was stopped goes on where it was: what is tried follows from the file, its seed and
/// the results alone. Nothing, after saying why, if a candidate cannot run or a goal cannot be
/// computed.
std::optional<SearchOutcome> RunSearch(const SearchFile& search, SweepStore* store,
                                       const RunRows& run_rows);

/// Whether a row is done and all conditions hold in it. Fails if one cannot be computed.
Result<bool> Fulfils(const SearchFile& search, const StoredRow& row);

/// The candidate as a file of settings, which `run --params` takes.
std::string SettingsOf(const SearchFile& search, const SearchCandidate& candidate);

}  // namespace morphbus::tools
