#pragma once
// A search as people write it, in TOML (docs/optimise.md): a sweep, which values are sought for in
// it, and what for.

#include <optional>
#include <string>
#include <vector>

#include "tools/sweep/search_method.h"
#include "tools/sweep/sweep_file.h"

namespace morphbus::tools {

/// What is sought for: an expression that is to be as large, or as small, as it can be.
struct SearchGoal {
  FigureExpression expression;
  bool smallest = false;
};

/// A file, read and checked as far as it can be without its model.
struct SearchFile {
  /// What every candidate runs: all rows of this sweep.
  SweepFile sweep;
  /// Settings whose values are sought, each a range.
  std::vector<SweepAxis> sought;
  /// One, or several of which none may be better for the worse of another.
  std::vector<SearchGoal> goals;
  /// What must hold in every run of a candidate.
  std::vector<FigureExpression> conditions;
  SearchAlgorithm algorithm = SearchAlgorithm::kCmaEs;
  /// Candidates of a generation, and generations of each start.
  int population = 0;
  int generations = 30;
  /// So many times the search begins anew, elsewhere.
  int restarts = 0;
  uint64_t seed = 1;
  /// The worst of a candidate's runs counts, and not their mean.
  bool worst = false;
};

/// Whether a sweep's file is one of a search: it has a table `search`.
bool IsSearch(const source::TomlValue::Table& file);

/// Reads a file as ReadSweepFile does. On the command line the keys of a search have single values.
std::optional<SearchFile> ReadSearchFile(source::SourceSet* sources, int file,
                                         const std::string& path,
                                         const std::vector<std::string>& overrides,
                                         source::Diagnostics* diagnostics);

}  // namespace morphbus::tools
