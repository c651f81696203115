#include "tools/sweep/sweep_columns.h"

#include <fmt/format.h>

#include <utility>

#include "compiler/base/quantity.h"
#include "tools/sweep/sweep_export.h"

namespace morphbus::tools {
namespace {

/// A value as the page has it.
Json Shown(const Json& value) {
  if (!value.is_number_float()) return value;
  // More digits than a plot can show would double the page.
  return ReadNumber<double>(fmt::format("{:.7g}", value.get<double>())).value_or(0);
}

}  // namespace

void SweepColumns::Look(const StoredRow& row) {
  LookAt(row.point, true);
  if (row.result && row.result->status == RowResult::Status::kRan) LookAt(FiguresOf(row), false);
}

void SweepColumns::LookAt(const Json& object, bool input) {
  for (const auto& [name, value] : object.items()) {
    const auto [seen, fresh] = seen_.try_emplace(name, Seen{value, input, false});
    if (fresh) {
      names_.push_back(name);
    } else if (seen->second.first.is_null()) {
      // A figure that the first rows do not have.
      seen->second.first = value;
    } else if (!value.is_null() && value != seen->second.first) {
      seen->second.varies = true;
    }
  }
}

void SweepColumns::ChooseColumns() {
  if (std::exchange(chosen_, true)) return;
  for (const bool input : {true, false}) {
    for (const std::string& name : names_) {
      const Seen& seen = seen_.at(name);
      // Texts among the figures, as hashes and roles, are nothing to be plotted.
      const bool plain = input || seen.first.is_number();
      if (seen.input == input && seen.varies && plain) columns_.push_back(name);
    }
  }
}

void SweepColumns::Add(const StoredRow& row, const Json& goal, const std::vector<Json>& goals,
                       bool allowed) {
  ChooseColumns();
  const Json figures = FiguresOf(row);
  Json values = Json::array();
  for (const std::string& name : columns_) {
    const Json& from = seen_.at(name).input ? row.point : figures;
    values.push_back(Shown(from.value(name, Json())));
  }
  Json shown = Json::array();
  for (const Json& one : goals) shown.push_back(Shown(one));
  rows_.push_back({{"row", row.place},
                   {"status", row.result ? StatusText(row.result->status) : "missing"},
                   {"error", row.result ? row.result->error : ""},
                   {"goal", Shown(goal)},
                   {"goals", std::move(shown)},
                   {"allowed", allowed},
                   {"values", values}});
}

Json SweepColumns::TakeJson() {
  ChooseColumns();
  Json columns = Json::array();
  for (const std::string& name : columns_) {
    columns.push_back({{"name", name}, {"kind", seen_.at(name).input ? "input" : "figure"}});
  }
  return {{"columns", columns}, {"rows", std::move(rows_)}};
}

}  // namespace morphbus::tools
