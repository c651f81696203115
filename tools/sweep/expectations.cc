#include "tools/sweep/expectations.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "tools/base/messages.h"
#include "tools/sweep/sweep_export.h"

namespace morphbus::tools {
namespace {

/// The rows that differ only in some axes: the first one's number and value.
struct Group {
  int64_t place = 0;
  Json value;
};

/// Looks at one expectation.
class Checker {
 public:
  explicit Checker(const SweepExpectation& expectation) : expectation_(expectation) {
    result_.text = expectation.same ? fmt::format("same {} over {}", expectation.expression.text(),
                                                  fmt::join(expectation.over, ", "))
                                    : expectation.expression.text();
    if (expectation.where) result_.text += fmt::format(" (where {})", expectation.where->text());
  }

  /// Fails for an expression that cannot be computed.
  Result<void> Look(const StoredRow& row) {
    if (expectation_.where) {
      const Result<Json> where = ValueIn(row, *expectation_.where);
      if (!where) return Fail(where.error().message);
      if (*where != true) return {};
    }
    ++result_.rows;
    const Result<Json> value = ValueIn(row, expectation_.expression);
    if (!value) return Fail(value.error().message);
    if (row.result && row.result->status != RowResult::Status::kRan) {
      Failed(row, row.result->error.empty() ? StatusText(row.result->status) : row.result->error);
    } else if (!row.result) {
      Failed(row, "it has not been run");
    } else if (value->is_null()) {
      Failed(row, "it is not known: " + Values(row));
    } else if (!expectation_.same) {
      if (!value->is_boolean())
        return Fail(expectation_.expression.text() + ": expected what is true or false");
      if (*value == false) Failed(row, Values(row));
    } else {
      Compare(row, *value);
    }
    return {};
  }
  /// The result, once all rows were looked at.
  ExpectationResult TakeResult() {
    result_.holds = result_.rows > 0 && result_.failures.empty();
    return std::move(result_);
  }

 private:
  void Failed(const StoredRow& row, std::string why) {
    result_.failures.push_back({row.place, std::move(why), row.point});
  }

  /// The figures that the expression names.
  static std::string ValueText(const Json& value) {
    return value.is_null() ? "not known" : PlainText(value);
  }
  [[nodiscard]] std::string Values(const StoredRow& row) const {
    std::vector<std::string> texts;
    for (const auto& [name, offset] : expectation_.expression.names()) {
      ExpressionError error;
      const auto one = FigureExpression::Read(name, &error);
      const Result<Json> value = one ? ValueIn(row, *one) : Result<Json>(Json());
      texts.push_back(fmt::format("{} is {}", name, value ? ValueText(*value) : "not known"));
    }
    return fmt::format("{}", fmt::join(texts, ", "));
  }

  void Compare(const StoredRow& row, const Json& value) {
    RunPoint rest = row.point;
    for (const std::string& axis : expectation_.over) rest.erase(axis);
    const auto [group, fresh] = groups_.try_emplace(JsonText(rest), Group{row.place, value});
    if (fresh || group->second.value == value) return;
    Failed(row, fmt::format("{}, in row {} {}", PlainText(value), group->second.place,
                            PlainText(group->second.value)));
  }

  const SweepExpectation& expectation_;
  ExpectationResult result_;
  /// By what the rows of a group have in common.
  std::map<std::string, Group> groups_;
};

}  // namespace

Result<Json> ValueIn(const StoredRow& row, const FigureExpression& expression) {
  const bool done = row.result && row.result->status == RowResult::Status::kRan;
  const Json figures = done ? FiguresOf(row) : Json::object();
  const auto lookup = [&](const std::string& name) -> std::optional<Json> {
    if (row.point.contains(name)) return row.point[name];
    if (name == "status") return row.result ? Json(StatusText(row.result->status)) : Json(nullptr);
    if (name == "hash") return done ? Json(row.result->hash) : Json(nullptr);
    // Which names there are is known of a run that has been.
    return done ? FigureOf(figures, name) : Json(nullptr);
  };
  ExpressionError error;
  Json value = expression.Evaluate(lookup, &error);
  if (error.message.empty()) return value;
  // The nearest name is a hint for what was misspelt.
  std::string hint;
  for (const auto& [name, offset] : expression.names()) {
    std::vector<std::string> names = {"status", "hash"};
    for (const auto& [key, figure] : figures.items()) names.push_back(key);
    if (!lookup(name)) hint = DidYouMean(name, names);
  }
  return Fail(fmt::format("{}: {}{} (row {})", expression.text(), error.message, hint, row.place));
}

Result<std::vector<ExpectationResult>> CheckExpectations(const SweepFile& sweep,
                                                         SweepStore* store) {
  std::vector<Checker> checkers;
  for (const SweepExpectation& expectation : sweep.expectations) checkers.emplace_back(expectation);
  Result<void> looked;
  const Result<void> read = store->EachRow([&](const StoredRow& row) {
    for (Checker& checker : checkers) {
      if (looked) looked = checker.Look(row);
    }
    return looked.has_value();
  });
  if (!read) return Fail(read.error().message);
  if (!looked) return Fail("expect: " + looked.error().message);
  std::vector<ExpectationResult> results;
  for (Checker& checker : checkers) results.push_back(checker.TakeResult());
  return results;
}

}  // namespace morphbus::tools
