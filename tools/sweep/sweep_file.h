#pragma once
// A sweep as people write it, in TOML (docs/sweep.md): what each run is told, which values are gone
// through and how, and what is expected of the rows.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "compiler/source/toml.h"
#include "tools/sweep/engine_settings.h"
#include "tools/sweep/figure_expression.h"
#include "tools/sweep/run_inputs.h"

namespace morphbus::tools {

/// An input or a setting with all the values that it takes.
struct SweepAxis {
  /// How a value is found for a row.
  enum class Kind {
    kEach,   ///< Every value in turn.
    kAmong,  ///< One of the values, drawn for each sample.
    kRange,  ///< A number from `from` to `to`, drawn for each sample.
  };
  /// As points name it.
  std::string name;
  Kind kind = Kind::kEach;
  std::vector<Json> values;
  double from = 0, to = 0;
  /// The logarithm is drawn evenly, and not the number.
  bool logarithmic = false;
  /// Only whole numbers are drawn.
  bool whole = false;
  source::Span span;
};

/// How values of ranges are drawn: independently, or so that each of n equal parts of a range has
/// one of the n samples (McKay, Beckman, Conover, "A Comparison of Three Methods for Selecting
/// Values of Input Variables", Technometrics 21 (1979)).
enum class SweepMethod { kGrid, kRandom, kLatin };

/// What is demanded of rows: that an expression holds for each, or that its value is the same in
/// all rows that differ only in the axes `over`.
struct SweepExpectation {
  FigureExpression expression;
  /// `same` and not `that`.
  bool same = false;
  std::vector<std::string> over;
  /// Only for rows for which this holds.
  std::optional<FigureExpression> where;
};

/// Of which rows logs are kept.
struct SweepKeep {
  int best = 0;
  /// The best rows are those in which this is largest, or smallest.
  std::optional<FigureExpression> by;
  bool smallest = false;
  bool failed = false;
};

/// A file, read and checked as far as it can be without its model.
struct SweepFile {
  /// Folder of the file: paths in it are relative to that.
  std::string folder;
  std::vector<SweepAxis> axes;
  /// [[run]]: what some runs are told beside and instead of the above. Empty: one run that is told
  /// nothing else.
  std::vector<RunPoint> runs;
  SweepMethod method = SweepMethod::kGrid;
  int samples = 0;
  uint64_t sample_seed = 1;
  /// So many congruent assemblies of each robot run, too.
  int variants = 0;
  std::vector<SweepExpectation> expectations;
  SweepKeep keep;
  EngineSettings engine;
};

/// Reads file number `file` of `sources`, of which `path` is the path. `overrides` are words of the
/// command line, "amplitude=10,20" or "amplitude=10..60:5": they take the place of what the file
/// says of that name. They are added to the sources, so that what is wrong with one has its place.
/// Nothing if something is wrong, which `diagnostics` then says.
std::optional<SweepFile> ReadSweepFile(source::SourceSet* sources, int file,
                                       const std::string& path,
                                       const std::vector<std::string>& overrides,
                                       source::Diagnostics* diagnostics);
/// The same of a file's tree.
std::optional<SweepFile> ReadSweepTable(source::SourceSet* sources, int file,
                                        const std::string& path, source::TomlValue::Table table,
                                        const std::vector<std::string>& overrides,
                                        source::Diagnostics* diagnostics);

}  // namespace morphbus::tools
