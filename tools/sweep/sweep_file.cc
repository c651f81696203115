#include "tools/sweep/sweep_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "tools/base/messages.h"
#include "tools/sweep/axis_reader.h"
#include "tools/sweep/file_reader.h"
#include "tools/sweep/sweep_tree.h"

namespace morphbus::tools {
namespace {

using source::TomlEntry;
using source::TomlValue;

/// All keys at the top, for hints.
std::vector<std::string> AllKeys() {
  std::vector<std::string> keys(kSweepKeys.begin(), kSweepKeys.end());
  for (const RunInput& input : RunInputs()) {
    keys.emplace_back(input.name);
    keys.emplace_back(input.plural);
  }
  return keys;
}

/// Reads one file, with what the command line says laid over it.
class SweepReader : private FileReader {
 public:
  SweepReader(int file, std::string folder, source::Diagnostics* diagnostics)
      : FileReader(file, diagnostics) {
    sweep_.folder = std::move(folder);
  }

  std::optional<SweepFile> Read(const TomlValue::Table& table) {
    for (const TomlEntry& entry : table) ReadEntry(entry);
    CheckWhole();
    if (diagnostics_.had_errors()) return std::nullopt;
    return std::move(sweep_);
  }

 private:
  void ReadEntry(const TomlEntry& entry) {
    const std::string& key = entry.key;
    if (const RunInput* input = FindInput(key))
      return AddAxis(std::string(input->name), input, entry);
    if (key == "variants") return ReadWhole(entry, 0, 10000, &sweep_.variants);
    if (key == "method") return ReadMethod(entry);
    if (key == "samples") return ReadWhole(entry, 1, kMostValues, &sweep_.samples);
    if (key == "sample_seed") return ReadWhole(entry, 0, INT64_MAX, &sweep_.sample_seed);
    if (key == "set") return ReadSettings(entry);
    if (key == "run") return ReadRuns(entry);
    if (key == "expect") return ReadExpectations(entry);
    if (key == "keep") return ReadKeep(entry);
    if (key == "engine") {
      sweep_.engine = ReadEngine(entry, &diagnostics_);
      return;
    }
    Wrong(entry.key_span, fmt::format("a sweep has no '{}'", key),
          key == kSearchTable
              ? "this is the file of a search: morphbus optimise runs it"
              : source::NearestHint(key, AllKeys(), "parameters of the program stand in [set]"));
  }

  /// Adds the values that stand behind a name. `input` is null for a setting.
  void AddAxis(const std::string& name, const RunInput* input, const TomlEntry& entry) {
    const auto same = [&name](const SweepAxis& axis) { return axis.name == name; };
    if (std::ranges::any_of(sweep_.axes, same)) {
      return Wrong(entry.key_span, fmt::format("'{}' was said already", name));
    }
    std::optional<SweepAxis> axis = ReadAxis(name, input, entry.value, &diagnostics_);
    if (!axis) return;
    for (Json& value : axis->values) Complete(input, entry.value.span, &value);
    sweep_.axes.push_back(std::move(*axis));
  }

  /// What the command line names lies in the working folder, and not beside the sweep's file.
  void Complete(const RunInput* input, const source::Span& span, Json* value) const {
    if (input == nullptr || input->kind != RunInput::Kind::kFile || span.file == file_) return;
    std::error_code unknown;
    const auto path = std::filesystem::absolute(value->get<std::string>(), unknown);
    if (!unknown && *value != "") *value = path.lexically_normal().string();
  }

  void ReadMethod(const TomlEntry& entry) {
    static const std::vector<std::string> names = {"grid", "random", "latin"};
    const std::string* name = entry.value.text();
    const auto found = name == nullptr ? names.end() : std::ranges::find(names, *name);
    if (found == names.end()) {
      return Wrong(entry.value.span, "expected \"grid\", \"random\" or \"latin\"",
                   name == nullptr ? "" : source::NearestHint(*name, names));
    }
    sweep_.method = static_cast<SweepMethod>(found - names.begin());
    method_span_ = entry.value.span;
  }

  /// [set]: parameters of the program and attributes of the model, by their whole names.
  void ReadSettings(const TomlEntry& entry) {
    const TomlValue::Table* table = entry.value.table();
    if (table == nullptr) return Wrong(entry.value.span, "expected a table: [set]");
    for (const TomlEntry& setting : *table) AddAxis(PointName(setting.key), nullptr, setting);
  }

  /// [[run]]: tables of single values.
  void ReadRuns(const TomlEntry& entry) {
    const TomlValue::Array* list = entry.value.array();
    if (list == nullptr || list->empty())
      return Wrong(entry.value.span, "expected tables: [[run]]");
    for (const TomlValue& run : *list) {
      RunPoint point = Json::object();
      const TomlValue::Table* table = run.table();
      if (table == nullptr) return Wrong(run.span, "expected a table: [[run]]");
      for (const TomlEntry& one : *table) ReadOfRun(one, &point);
      sweep_.runs.push_back(std::move(point));
    }
  }
  /// One value of a [[run]], or those in its `set`.
  void ReadOfRun(const TomlEntry& entry, RunPoint* point) {
    const auto take = [this, point](const std::string& name, const RunInput* input,
                                    const TomlEntry& of) {
      const std::optional<SweepAxis> axis = ReadAxis(name, input, of.value, &diagnostics_);
      if (!axis) return;
      if (axis->kind != SweepAxis::Kind::kEach || axis->values.size() != 1) {
        return Wrong(of.value.span, "a [[run]] has one value of each",
                     "what all runs go through stands above them");
      }
      if (point->contains(name)) {
        return Wrong(of.key_span, fmt::format("'{}' was said already", name));
      }
      (*point)[name] = axis->values.front();
    };
    if (const RunInput* input = FindInput(entry.key)) {
      return take(std::string(input->name), input, entry);
    }
    const TomlValue::Table* settings = entry.value.table();
    if (entry.key != "set" || settings == nullptr) {
      return Wrong(
          entry.key_span, fmt::format("a [[run]] has no '{}'", entry.key),
          source::NearestHint(entry.key, AllKeys(), "parameters stand in set = {NAME = VALUE}"));
    }
    for (const TomlEntry& setting : *settings) take(PointName(setting.key), nullptr, setting);
  }

  /// [[expect]]: `that = "…"`, or `same = "…"` with `over = ["seed"]`; and `where = "…"`.
  void ReadExpectations(const TomlEntry& entry) {
    const TomlValue::Array* list = entry.value.array();
    if (list == nullptr) return Wrong(entry.value.span, "expected tables: [[expect]]");
    for (const TomlValue& one : *list) {
      const TomlValue::Table* table = one.table();
      if (table == nullptr) return Wrong(one.span, "expected a table: [[expect]]");
      ReadExpectation(*table, one.span);
    }
  }
  void ReadExpectation(const TomlValue::Table& table, const source::Span& span) {
    std::optional<FigureExpression> that, where;
    SweepExpectation expectation;
    for (const TomlEntry& entry : table) {
      if (entry.key == "that" || entry.key == "same") {
        if (that) return Wrong(entry.key_span, "expected 'that' or 'same', not both");
        that = ReadExpression(entry.value);
        if (!that) return;
        expectation.same = entry.key == "same";
      } else if (entry.key == "where") {
        where = ReadExpression(entry.value);
        if (!where) return;
      } else if (entry.key == "over") {
        ReadOver(entry.value, &expectation);
      } else {
        Wrong(entry.key_span, fmt::format("[[expect]] has no '{}'", entry.key),
              source::NearestHint(entry.key, {"that", "same", "over", "where"}));
      }
    }
    // `over` makes sense with `same` alone, and `same` with `over` alone.
    if (!that) return Wrong(span, "expected that = \"…\" or same = \"…\"");
    if (expectation.same == expectation.over.empty()) {
      return Wrong(span, expectation.same ? "'same' says over which axes: over = [\"seed\"]"
                                          : "'over' belongs to 'same'");
    }
    expectation.expression = std::move(*that);
    expectation.where = std::move(where);
    sweep_.expectations.push_back(std::move(expectation));
  }
  /// Names of axes, of which the whole file must be read to know whether there are such.
  void ReadOver(const TomlValue& value, SweepExpectation* expectation) {
    const TomlValue::Array* list = value.array();
    if (list == nullptr) return Wrong(value.span, "expected a list: over = [\"seed\"]");
    for (const TomlValue& name : *list) {
      if (name.text() == nullptr) return Wrong(name.span, "expected the name of an axis");
      over_.emplace_back(*name.text(), name.span);
      // A plural means the same axis.
      const RunInput* input = FindInput(*name.text());
      expectation->over.push_back(input != nullptr ? std::string(input->name) : *name.text());
    }
  }

  /// keep = {best = 5, by = "displacement.north", failed = true}
  void ReadKeep(const TomlEntry& entry) {
    const TomlValue::Table* table = entry.value.table();
    if (table == nullptr)
      return Wrong(entry.value.span, "expected a table: keep = {failed = true}");
    // Two keys have a value of their own kind, the other two are truths.
    for (const TomlEntry& one : *table) {
      const bool* truth = std::get_if<bool>(&one.value.content);
      if (one.key == "best") {
        ReadWhole(one, 1, 10000, &sweep_.keep.best);
      } else if (one.key == "by") {
        sweep_.keep.by = ReadExpression(one.value);
      } else if (one.key != "failed" && one.key != "smallest") {
        Wrong(one.key_span, fmt::format("keep has no '{}'", one.key),
              source::NearestHint(one.key, {"best", "by", "smallest", "failed"}));
      } else if (truth == nullptr) {
        Wrong(one.value.span, "expected true or false");
      } else {
        (one.key == "failed" ? sweep_.keep.failed : sweep_.keep.smallest) = *truth;
      }
    }
    if ((sweep_.keep.best > 0) != sweep_.keep.by.has_value() && !diagnostics_.had_errors()) {
      Wrong(entry.value.span,
            "'best' and 'by' belong together: best = 5, by = \"displacement.north\"");
    }
  }

  /// What only the whole can show.
  void CheckWhole() {
    const source::Span top = {file_, 0, 1};
    // What every run needs stands above, or in each [[run]].
    for (const char* needed : {"model", "program", "seconds"}) {
      const bool above = FindAxis(needed) != nullptr;
      const bool in_runs =
          !sweep_.runs.empty() && std::ranges::all_of(sweep_.runs, [needed](const RunPoint& run) {
            return run.contains(needed);
          });
      if (!above && !in_runs)
        Wrong(top, fmt::format("the sweep does not say its {}", needed),
              fmt::format("add {} = …", needed));
    }
    // Axes that an expectation names may be settings, whose names only the whole file has.
    for (const auto& [name, span] : over_) {
      const RunInput* input = FindInput(name);
      const std::string axis = input != nullptr ? std::string(input->name) : name;
      const bool in_runs =
          std::ranges::any_of(sweep_.runs, [&](const RunPoint& run) { return run.contains(axis); });
      if (FindAxis(axis) != nullptr || in_runs || (axis == kVariant && sweep_.variants > 0))
        continue;
      std::vector<std::string> names;
      for (const SweepAxis& one : sweep_.axes) names.push_back(one.name);
      Wrong(span, fmt::format("the sweep has no axis '{}'", name),
            source::NearestHint(name, names));
    }
    CheckNames(sweep_, sweep_.axes);
    CheckSamples();
    if (sweep_.runs.empty()) sweep_.runs.push_back(Json::object());
  }
  /// Ranges, method and number of samples go together, or none of them is there.
  void CheckSamples() {
    const SweepAxis* drawn = nullptr;
    for (const SweepAxis& axis : sweep_.axes) {
      if (axis.kind != SweepAxis::Kind::kEach) drawn = &axis;
    }
    const bool samples = sweep_.method != SweepMethod::kGrid;
    if (!samples && drawn != nullptr) {
      Wrong(drawn->span, "of this samples are drawn, but the sweep does not say how",
            "give the range a step or a count, or add method = \"random\" or \"latin\", and "
            "samples = …");
    } else if (samples && drawn == nullptr) {
      Wrong(method_span_, "there is nothing to draw samples of",
            "a range has from and to: {from = 10, to = 60}");
    } else if (samples && sweep_.samples == 0) {
      Wrong(method_span_, "the sweep does not say how many samples are drawn", "add samples = …");
    } else if (!samples && sweep_.samples > 0) {
      Wrong({file_, 0, 1}, "samples are drawn by method = \"random\" or \"latin\"");
    }
  }
  [[nodiscard]] const SweepAxis* FindAxis(std::string_view name) const {
    const auto found = std::ranges::find(sweep_.axes, name, &SweepAxis::name);
    return found == sweep_.axes.end() ? nullptr : &*found;
  }

  SweepFile sweep_;
  source::Span method_span_;
  /// The names behind `over`, with their places.
  std::vector<std::pair<std::string, source::Span>> over_;
};

}  // namespace

std::optional<SweepFile> ReadSweepFile(source::SourceSet* sources, int file,
                                       const std::string& path,
                                       const std::vector<std::string>& overrides,
                                       source::Diagnostics* diagnostics) {
  source::CheckUtf8(*sources, file, diagnostics);
  if (diagnostics->had_errors()) return std::nullopt;
  std::optional<TomlValue::Table> table = source::ParseToml(*sources, file, diagnostics);
  if (!table) return std::nullopt;
  return ReadSweepTable(sources, file, path, std::move(*table), overrides, diagnostics);
}

std::optional<SweepFile> ReadSweepTable(source::SourceSet* sources, int file,
                                        const std::string& path, TomlValue::Table table,
                                        const std::vector<std::string>& overrides,
                                        source::Diagnostics* diagnostics) {
  FlattenSettings(&table);
  for (const std::string& text : overrides) {
    if (!LayOver(sources, text, &table, diagnostics)) return std::nullopt;
  }
  return SweepReader(file, std::filesystem::path(path).parent_path().string(), diagnostics)
      .Read(table);
}

}  // namespace morphbus::tools
