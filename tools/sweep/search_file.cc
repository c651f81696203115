#include "tools/sweep/search_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tools/sweep/axis_reader.h"
#include "tools/sweep/file_reader.h"
#include "tools/sweep/sweep_tree.h"

namespace morphbus::tools {
namespace {

using source::TomlEntry;
using source::TomlValue;

/// Keys at the top that a sweep does not have.
constexpr std::array<std::string_view, 10> kSearchKeys = {
    kSearchTable, "maximise",    "minimise", "subject_to",  "algorithm",
    "population", "generations", "restarts", "search_seed", "of_runs"};

bool IsSearchKey(std::string_view key) {
  return std::ranges::find(kSearchKeys, key) != kSearchKeys.end();
}

/// Reads what a search has beyond its sweep.
class SearchReader : private FileReader {
 public:
  SearchReader(int file, source::Diagnostics* diagnostics) : FileReader(file, diagnostics) {}

  void Read(const TomlValue::Table& table) {
    for (const TomlEntry& entry : table) ReadEntry(entry);
  }

  /// The whole of it, with its sweep; nothing if something is wrong.
  std::optional<SearchFile> Take(SweepFile sweep) {
    search_.sweep = std::move(sweep);
    CheckWhole();
    if (diagnostics_.had_errors()) return std::nullopt;
    return std::move(search_);
  }

 private:
  void ReadEntry(const TomlEntry& entry) {
    const std::string& key = entry.key;
    if (key == kSearchTable) return ReadSought(entry);
    if (key == "maximise" || key == "minimise") return ReadGoals(entry);
    if (key == "subject_to") return ReadConditions(entry);
    if (key == "algorithm") return ReadAlgorithm(entry);
    if (key == "of_runs") return ReadOfRuns(entry);
    int64_t seed = 1;
    if (key == "population") return ReadWhole(entry, 5, 10000, &search_.population);
    if (key == "generations") return ReadWhole(entry, 1, 100000, &search_.generations);
    if (key == "restarts") return ReadWhole(entry, 0, 1000, &search_.restarts);
    ReadWhole(entry, 0, UINT32_MAX, &seed);
    search_.seed = static_cast<uint64_t>(seed);
  }

  /// [search]: settings, each with a range.
  void ReadSought(const TomlEntry& entry) {
    const TomlValue::Table* table = entry.value.table();
    if (table == nullptr || table->empty()) {
      return Wrong(entry.value.span, "expected a table: [search]");
    }
    // Settings have their whole names already (FlattenSettings).
    for (const TomlEntry& setting : *table) {
      std::optional<SweepAxis> axis =
          ReadAxis(PointName(setting.key), nullptr, setting.value, &diagnostics_);
      if (!axis) continue;
      if (axis->kind != SweepAxis::Kind::kRange) {
        Wrong(setting.value.span, "expected a range: {from = 10, to = 60}",
              "what all candidates have stands in [set]");
        continue;
      }
      search_.sought.push_back(std::move(*axis));
    }
  }

  /// A text, or a list of texts, each an expression.
  std::vector<FigureExpression> ReadExpressions(const TomlValue& value) {
    constexpr const char* kExample = "gait.forward_m";
    std::vector<FigureExpression> expressions;
    const TomlValue::Array one = {value};
    const TomlValue::Array* list = value.array() != nullptr ? value.array() : &one;
    if (list->empty()) Wrong(value.span, fmt::format("expected a text: \"{}\"", kExample));
    for (const TomlValue& item : *list) {
      std::optional<FigureExpression> expression = ReadExpression(item, kExample);
      if (expression) expressions.push_back(std::move(*expression));
    }
    return expressions;
  }

  void ReadGoals(const TomlEntry& entry) {
    for (FigureExpression& expression : ReadExpressions(entry.value)) {
      search_.goals.push_back({std::move(expression), entry.key == "minimise"});
    }
  }

  void ReadConditions(const TomlEntry& entry) { search_.conditions = ReadExpressions(entry.value); }

  /// Reads a word that is one of two; which one it is.
  std::optional<bool> ReadSecond(const TomlEntry& entry, std::string_view first,
                                 std::string_view second) {
    const std::string* word = entry.value.text();
    if (word != nullptr && *word == first) return false;
    if (word != nullptr && *word == second) return true;
    Wrong(entry.value.span, fmt::format("expected \"{}\" or \"{}\"", first, second));
    return std::nullopt;
  }

  void ReadAlgorithm(const TomlEntry& entry) {
    algorithm_span_ = entry.value.span;
    if (const auto second = ReadSecond(entry, "cma-es", "nsga-2")) {
      search_.algorithm = *second ? SearchAlgorithm::kNsga2 : SearchAlgorithm::kCmaEs;
    }
  }

  void ReadOfRuns(const TomlEntry& entry) {
    if (const auto second = ReadSecond(entry, "mean", "worst")) search_.worst = *second;
  }

  /// What only the whole can show.
  void CheckWhole() {
    const source::Span top = {file_, 0, 1};
    if (search_.goals.empty()) {
      Wrong(top, "the search does not say what for", "add maximise = \"gait.forward_m\"");
    }
    if (search_.sought.empty()) Wrong(top, "there is nothing to be sought", "add [search]");
    // Every candidate would say such a setting twice.
    for (const SweepAxis& axis : search_.sought) {
      const auto same = [&axis](const SweepAxis& one) { return one.name == axis.name; };
      if (std::ranges::any_of(search_.sweep.axes, same)) {
        Wrong(axis.span, fmt::format("'{}' is set, and sought, too", axis.name));
      }
    }
    if (search_.sweep.method != SweepMethod::kGrid) {
      Wrong(top, "a search draws no samples: leave out method and samples");
    }
    const bool one_goal = search_.goals.size() == 1;
    // Who has named no algorithm gets the one that the goals ask for.
    if (!algorithm_span_) {
      search_.algorithm = one_goal ? SearchAlgorithm::kCmaEs : SearchAlgorithm::kNsga2;
    } else if (!one_goal && search_.algorithm == SearchAlgorithm::kCmaEs) {
      Wrong(*algorithm_span_, "CMA-ES has one goal; \"nsga-2\" may have several");
    }
    CheckPopulation(top);
    std::vector<SweepAxis> axes = search_.sweep.axes;
    axes.insert(axes.end(), search_.sought.begin(), search_.sought.end());
    CheckNames(search_.sweep, axes);
  }

  void CheckPopulation(const source::Span& top) {
    const bool nsga = search_.algorithm == SearchAlgorithm::kNsga2;
    if (search_.population == 0) {
      // Hansen's own size for CMA-ES.
      const double n = static_cast<double>(search_.sought.size());
      search_.population = nsga ? 40 : std::max(6, 4 + static_cast<int>(3 * std::log(n + 1)));
    }
    if (nsga && search_.population % 4 != 0) {
      Wrong(top, "NSGA-II pairs its candidates: expected a population that is a multiple of 4");
    }
  }

  SearchFile search_;
  std::optional<source::Span> algorithm_span_;
};

/// Lays "KEY=VALUE" over a tree, if the key is one of a search.
bool LaySearchKey(source::SourceSet* sources, const std::string& text, TomlValue::Table* table) {
  const size_t equals = std::min(text.find('='), text.size());
  const std::string key = text.substr(0, equals);
  if (!IsSearchKey(key) || equals == text.size()) return false;
  const int word = sources->AddText("the command line", text);
  TomlEntry entry = {key,
                     {word, 0, equals},
                     ValueOfWord(std::string_view(text).substr(equals + 1), word, equals + 1)};
  std::erase_if(*table, [&key](const TomlEntry& one) { return one.key == key; });
  table->push_back(std::move(entry));
  return true;
}

}  // namespace

bool IsSearch(const TomlValue::Table& file) {
  return std::ranges::find(file, kSearchTable, &TomlEntry::key) != file.end();
}

std::optional<SearchFile> ReadSearchFile(source::SourceSet* sources, int file,
                                         const std::string& path,
                                         const std::vector<std::string>& overrides,
                                         source::Diagnostics* diagnostics) {
  source::CheckUtf8(*sources, file, diagnostics);
  if (diagnostics->had_errors()) return std::nullopt;
  std::optional<TomlValue::Table> table = source::ParseToml(*sources, file, diagnostics);
  if (!table) return std::nullopt;
  FlattenSettings(&*table);
  std::vector<std::string> of_sweep;
  for (const std::string& word : overrides) {
    if (!LaySearchKey(sources, word, &*table)) of_sweep.push_back(word);
  }
  // What is the sweep's goes on to its own reader.
  const auto rest = std::stable_partition(
      table->begin(), table->end(), [](const TomlEntry& one) { return IsSearchKey(one.key); });
  TomlValue::Table sweep_table(std::make_move_iterator(rest),
                               std::make_move_iterator(table->end()));
  table->erase(rest, table->end());
  SearchReader reader(file, diagnostics);
  reader.Read(*table);
  std::optional<SweepFile> sweep =
      ReadSweepTable(sources, file, path, std::move(sweep_table), of_sweep, diagnostics);
  return sweep ? reader.Take(std::move(*sweep)) : std::nullopt;
}

}  // namespace morphbus::tools
