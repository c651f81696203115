#include "tools/sweep/search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "compiler/base/quantity.h"
#include "compiler/base/split_mix.h"
#include "compiler/dynarole/parameters.h"
#include "compiler/model/attributes.h"
#include "tools/base/messages.h"
#include "tools/launch/launcher_link.h"
#include "tools/sweep/expectations.h"
#include "tools/sweep/sampling.h"

namespace morphbus::tools {
namespace {

/// What a candidate that must not be chosen counts as: worse than all that may be, and the worse
/// the more of its runs are broken.
constexpr double kForbidden = 1e12;

/// A value with six digits: nobody needs more, people can read it, and the last bits of a machine's
/// arithmetic do not come into the inputs of a run.
Json Rounded(const SweepAxis& axis, const Json& value) {
  if (value.is_number_integer()) return value;
  const double number = value.get<double>();
  const double rounded = ReadNumber<double>(fmt::format("{:.6g}", number)).value_or(number);
  return std::clamp(rounded, axis.from, axis.to);
}

/// The fraction of an axis at which a value lies.
double FractionOf(const SweepAxis& axis, double value) {
  const double held = std::clamp(value, axis.from, axis.to);
  if (axis.logarithmic) {
    return (std::log(held) - std::log(axis.from)) / (std::log(axis.to) - std::log(axis.from));
  }
  // The middle of a whole number's share.
  const double first = std::ceil(axis.from), last = std::floor(axis.to);
  if (axis.whole) return (std::round(held) - first + 0.5) / (last - first + 1);
  return (held - axis.from) / (axis.to - axis.from);
}

/// The value of every setting that a run has: parameters of its program, by the names with and
/// without their roles, and attributes of its model.
std::map<std::string, double> SettingsIn(const std::string& description) {
  std::map<std::string, double> values;
  const Result<RunPlan> plan = PlanFromDescription(description);
  if (!plan) return values;
  for (const model::SettableAttribute& one : model::SettableAttributes(plan->model)) {
    if (one.value) values[one.name] = *one.value;
  }
  const auto program = VerifyProgram(plan->description.program_image());
  if (!program) return values;
  for (const dynarole::ProgramParameter& one : dynarole::ParametersOf(**program)) {
    values[one.name] = one.value;
    values.try_emplace(one.name.substr(one.name.find('.') + 1), one.value);
  }
  return values;
}

/// One search.
class Search {
 public:
  Search(const SearchFile& search, SweepStore* store, const RunRows& run_rows)
      : search_(search), store_(*store), run_rows_(run_rows), planner_(search.sweep) {}

  std::optional<SearchOutcome> Run() {
    Result<std::vector<RunPoint>> points = PointsOf(search_.sweep);
    if (!points) return Refuse(points.error().message);
    points_ = std::move(*points);
    // First as it is without any search, to tell what was gained. Until that has run no goal of it
    // is known.
    outcome_.shipped.goals.resize(search_.goals.size());
    std::optional<std::vector<SearchCandidate>> shipped = Evaluate({{}}, "as it is: ");
    if (!shipped) return std::nullopt;
    if (outcome_.stopped) return std::move(outcome_);
    outcome_.shipped = std::move(shipped->front());
    for (int start = 0; start <= search_.restarts && !outcome_.stopped; ++start) {
      if (!RunFrom(start)) return std::nullopt;
    }
    return std::move(outcome_);
  }

 private:
  /// One start, with all its generations.
  bool RunFrom(int start) {
    const std::optional<std::vector<std::vector<double>>> first = First(start);
    if (!first) return false;
    SearchMethod method(search_.algorithm, static_cast<int>(search_.goals.size()),
                        search_.seed + static_cast<uint64_t>(start), *first);
    // Each generation follows from what the ones before it came to, and its candidates run side by
    // side.
    for (int generation = 1; generation <= search_.generations; ++generation) {
      const std::vector<std::vector<double>> asked = method.Ask();
      std::vector<std::vector<Json>> values;
      for (const std::vector<double>& vector : asked) values.push_back(ValuesAt(vector));
      std::optional<std::vector<SearchCandidate>> tried =
          Evaluate(values, Label(start, generation));
      if (!tried) return false;
      if (outcome_.stopped) return true;
      std::vector<std::vector<double>> told;
      for (const SearchCandidate& candidate : *tried) told.push_back(CostsOf(search_, candidate));
      method.Tell(told);
      ++outcome_.generations;
      for (SearchCandidate& one : *tried) outcome_.candidates.push_back(std::move(one));
    }
    return true;
  }

  /// "start 2, generation 3 of 30, best 0.12: ".
  [[nodiscard]] std::string Label(int start, int generation) const {
    std::string label = start > 0 ? fmt::format("start {}, ", start + 1) : "";
    label += fmt::format("generation {} of {}", generation, search_.generations);
    const std::vector<size_t> best = outcome_.Best(search_);
    if (best.empty()) return label + ": ";
    if (search_.goals.size() > 1) return label + fmt::format(", {} on the front: ", best.size());
    return label + fmt::format(", best {:.4g}: ", *outcome_.candidates[best.front()].goals.front());
  }

  /// The first generation of a start: that of the first one begins with the values that there are.
  std::optional<std::vector<std::vector<double>>> First(int start) {
    std::vector<std::vector<double>> first;
    if (start == 0) {
      const Result<std::optional<StoredRow>> row = store_.RowAt(outcome_.shipped.row);
      if (!row || !*row) return Refuse(row ? "the first row is gone" : row.error().message);
      const Result<std::string> description = store_.DescriptionOf((*row)->key);
      if (!description) return Refuse(description.error().message);
      const std::map<std::string, double> values = SettingsIn(*description);
      std::vector<double> shipped;
      for (const SweepAxis& axis : search_.sought) {
        const auto value = values.find(SettingName(axis.name));
        shipped.push_back(value == values.end() ? 0.5 : FractionOf(axis, value->second));
      }
      first.push_back(std::move(shipped));
    }
    // The others anywhere, by numbers that are the same on every machine.
    SplitMix64 random(SplitMix64::Mix(search_.seed + static_cast<uint64_t>(start)));
    while (static_cast<int>(first.size()) < search_.population) {
      std::vector<double>& vector = first.emplace_back();
      for (size_t i = 0; i < search_.sought.size(); ++i) vector.push_back(random.NextFraction());
    }
    return first;
  }

  [[nodiscard]] std::vector<Json> ValuesAt(const std::vector<double>& vector) const {
    std::vector<Json> values;
    for (size_t i = 0; i < vector.size(); ++i) {
      values.push_back(Rounded(search_.sought[i], ValueAt(search_.sought[i], vector[i])));
    }
    return values;
  }

  /// Runs candidates, each in all rows of the sweep. Without values: as program and model are.
  std::optional<std::vector<SearchCandidate>> Evaluate(
      const std::vector<std::vector<Json>>& candidates, const std::string& label) {
    // The rows of a candidate stand behind each other, one for each point of the sweep.
    for (const std::vector<Json>& values : candidates) {
      for (RunPoint point : points_) {
        for (size_t i = 0; i < values.size(); ++i) point[search_.sought[i].name] = values[i];
        if (planner_.Add(point)) continue;
        return Refuse(fmt::format("a candidate cannot run: {}", PointText(point)));
      }
    }
    const int64_t from = next_row_;
    next_row_ += static_cast<int64_t>(candidates.size() * points_.size());
    if (const Result<void> added = store_.Extend(planner_.Take()); !added) {
      return Refuse(added.error().message);
    }
    if (!run_rows_(from, label)) return std::nullopt;
    // A generation that a signal has cut short is none: the next search tries all of it again, and
    // finds the results that there are.
    outcome_.stopped = CaughtSignal() != 0;
    std::vector<SearchCandidate> evaluated;
    if (outcome_.stopped) return evaluated;
    for (size_t i = 0; i < candidates.size(); ++i) {
      const auto row = from + static_cast<int64_t>(i * points_.size());
      std::optional<SearchCandidate> one = Read(row, candidates[i]);
      if (!one) return std::nullopt;
      evaluated.push_back(std::move(*one));
    }
    return evaluated;
  }

  /// A candidate by the results of its rows.
  std::optional<SearchCandidate> Read(int64_t from, const std::vector<Json>& values) {
    SearchCandidate candidate = {values, {}, 0, from};
    std::vector<std::vector<double>> known(search_.goals.size());
    for (size_t i = 0; i < points_.size(); ++i) {
      const Result<std::optional<StoredRow>> row = store_.RowAt(from + static_cast<int64_t>(i));
      if (!row || !*row) return Refuse(row ? "a row is gone" : row.error().message);
      const Result<bool> whole = ReadRow(**row, &known);
      if (!whole) return Refuse(whole.error().message);
      if (!*whole) ++candidate.broken;
    }
    // A goal that one of the runs does not have is none of the candidate's.
    for (size_t goal = 0; goal < known.size(); ++goal) {
      candidate.goals.push_back(known[goal].size() < points_.size()
                                    ? std::nullopt
                                    : std::optional(Together(known[goal], search_.goals[goal])));
    }
    return candidate;
  }

  /// Adds what a row says of each goal. False if a condition does not hold in it, or a goal is not
  /// known.
  Result<bool> ReadRow(const StoredRow& row, std::vector<std::vector<double>>* known) {
    const bool done = row.result && row.result->status == RowResult::Status::kRan;
    bool whole = done;
    for (size_t goal = 0; goal < search_.goals.size() && done; ++goal) {
      const FigureExpression& expression = search_.goals[goal].expression;
      const Result<Json> value = ValueIn(row, expression);
      if (!value) return Fail(value.error().message);
      if (!value->is_number() && !value->is_null()) {
        return Fail(expression.text() + " is no number, which could be large or small");
      }
      if (value->is_number()) (*known)[goal].push_back(value->get<double>());
      whole = whole && value->is_number();
    }
    const Result<bool> fulfils = Fulfils(search_, row);
    return fulfils ? Result<bool>(whole && *fulfils) : fulfils;
  }

  /// What several runs say together.
  [[nodiscard]] double Together(const std::vector<double>& values, const SearchGoal& goal) const {
    if (search_.worst) {
      return goal.smallest ? *std::ranges::max_element(values) : *std::ranges::min_element(values);
    }
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }

  const SearchFile& search_;
  SweepStore& store_;
  const RunRows& run_rows_;
  SweepPlanner planner_;
  /// What every candidate runs.
  std::vector<RunPoint> points_;
  int64_t next_row_ = 1;
  SearchOutcome outcome_;
};

}  // namespace

bool CheckRanges(const SearchFile& search) {
  const Result<std::vector<RunPoint>> points = PointsOf(search.sweep);
  if (!points) {
    Unusable(points.error().message);
    return false;
  }
  // Which values may be depends on the program and the model, which each point of the sweep names.
  SweepPlanner planner(search.sweep);
  for (RunPoint point : *points) {
    for (const double end : {0.0, 1.0}) {
      for (const SweepAxis& axis : search.sought) {
        point[axis.name] = Rounded(axis, ValueAt(axis, end));
      }
      if (planner.Add(point)) continue;
      Unusable(
          fmt::format("the ends of what is searched cannot run (an int wants whole = true): {}",
                      PointText(point)));
      return false;
    }
  }
  return true;
}

std::vector<double> CostsOf(const SearchFile& search, const SearchCandidate& candidate) {
  std::vector<double> costs;
  for (size_t goal = 0; goal < search.goals.size(); ++goal) {
    const double value = candidate.goals[goal].value_or(0);
    costs.push_back(!candidate.allowed()          ? kForbidden * candidate.broken
                    : search.goals[goal].smallest ? value
                                                  : -value);
  }
  return costs;
}

std::vector<size_t> SearchOutcome::Best(const SearchFile& search) const {
  std::vector<size_t> allowed;
  std::vector<std::vector<double>> costs;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (!candidates[i].allowed()) continue;
    allowed.push_back(i);
    costs.push_back(CostsOf(search, candidates[i]));
  }
  std::vector<size_t> best;
  if (search.goals.size() == 1 && !costs.empty()) {
    // Of equal ones the first.
    return {allowed[static_cast<size_t>(std::ranges::min_element(costs) - costs.begin())]};
  }
  for (const size_t index : ParetoFront(costs)) best.push_back(allowed[index]);
  return best;
}

std::optional<SearchOutcome> RunSearch(const SearchFile& search, SweepStore* store,
                                       const RunRows& run_rows) {
  return Search(search, store, run_rows).Run();
}

Result<bool> Fulfils(const SearchFile& search, const StoredRow& row) {
  if (!row.result || row.result->status != RowResult::Status::kRan) return false;
  bool all = true;
  for (const FigureExpression& condition : search.conditions) {
    const Result<Json> value = ValueIn(row, condition);
    if (!value) return Fail(value.error().message);
    if (!value->is_boolean() && !value->is_null()) {
      return Fail(condition.text() + ": expected what is true or false");
    }
    all = all && *value == true;
  }
  return all;
}

std::string SettingsOf(const SearchFile& search, const SearchCandidate& candidate) {
  std::string text = "# Found by morphbus optimise.\n";
  for (size_t goal = 0; goal < search.goals.size(); ++goal) {
    const SearchGoal& one = search.goals[goal];
    text += fmt::format(
        "# {} {}: {}\n", one.smallest ? "least" : "most", one.expression.text(),
        candidate.goals[goal] ? fmt::format("{:.6g}", *candidate.goals[goal]) : "not known");
  }
  text += fmt::format("# Row {} of the search.\n", candidate.row);
  for (size_t i = 0; i < candidate.values.size(); ++i) {
    // A name with points in it is one key in quotation marks.
    text += fmt::format("\"{}\" = {}\n", SettingName(search.sought[i].name),
                        PlainText(candidate.values[i]));
  }
  return text;
}

}  // namespace morphbus::tools
