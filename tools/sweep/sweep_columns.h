#pragma once
// The rows of a sweep as columns, for plots: the inputs in which rows differ, and their figures.

#include <map>
#include <string>
#include <vector>

#include "tools/sweep/sweep_store.h"

namespace morphbus::tools {

/// Gathers columns. All rows are looked at first, to find the names of what differs between them;
/// then those rows are added that are to be shown.
class SweepColumns {
 public:
  /// Looks at a row.
  void Look(const StoredRow& row);
  /// Adds a row, with the value of the page's goal, and if it is one of a search those of the
  /// search's goals and whether its conditions hold.
  void Add(const StoredRow& row, const Json& goal, const std::vector<Json>& goals, bool allowed);
  /// {"columns": [{"name", "kind": "input" or "figure"}…], "rows": [{"row", "status", "error",
  /// "goal", "goals": […], "allowed", "values": […]}…]}: a value a column, null for what a row does
  /// not have, numbers to seven digits.
  [[nodiscard]] Json TakeJson();

 private:
  /// What is known of a name: its first value, and whether another one came.
  struct Seen {
    Json first;
    bool input = false;
    bool varies = false;
  };
  void LookAt(const Json& object, bool input);
  /// The names that are columns, inputs first; known once the first row is added.
  void ChooseColumns();

  std::map<std::string, Seen, std::less<>> seen_;
  /// Names in the order in which they first came.
  std::vector<std::string> names_;
  std::vector<std::string> columns_;
  bool chosen_ = false;
  Json rows_ = Json::array();
};

}  // namespace morphbus::tools
