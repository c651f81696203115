#include "tools/sweep/best_rows.h"

#include <algorithm>
#include <functional>

#include "tools/sweep/expectations.h"

namespace morphbus::tools {

Result<std::vector<RankedRow>> BestRows(SweepStore* store, const FigureExpression& by,
                                        bool smallest, int count) {
  std::vector<RankedRow> best;
  std::string wrong;
  const auto better = [smallest](double a, double b) { return smallest ? a < b : a > b; };
  const Result<void> read = store->EachRow([&](const StoredRow& row) {
    if (!row.result || row.result->status != RowResult::Status::kRan) return true;
    const Result<Json> value = ValueIn(row, by);
    if (!value) {
      wrong = value.error().message;
    } else if (!value->is_number() && !value->is_null()) {
      wrong = by.text() + " is no number, by which rows could be compared";
    }
    if (!wrong.empty()) return false;
    if (value->is_null()) return true;
    // Behind the rows that are as good, so that the first of equal ones stays.
    const double number = value->get<double>();
    const auto place = std::ranges::upper_bound(best, number, better, &RankedRow::value);
    best.insert(place, {number, row});
    if (static_cast<int>(best.size()) > count) best.pop_back();
    return true;
  });
  if (!read) return Fail(read.error().message);
  if (!wrong.empty()) return Fail(wrong);
  return best;
}

}  // namespace morphbus::tools
