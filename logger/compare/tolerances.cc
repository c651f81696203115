#include "logger/compare/tolerances.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "compiler/base/quantity.h"
#include "compiler/source/toml.h"

namespace morphbus::logger {
namespace {

/// Reads one file. Each table may hold tolerances, and at the top roles, and in those labels.
class ToleranceReader {
 public:
  explicit ToleranceReader(source::Diagnostics* diagnostics) : diagnostics_(*diagnostics) {}

  /// Reads the whole tree.
  std::vector<ToleranceEntry> Read(const source::TomlValue::Table& table) {
    ReadTable(table, "*", "*", "role");
    // The order of the text decides which entry counts, also where its tables are interleaved.
    std::ranges::stable_sort(found_, {}, &Found::offset);
    std::vector<ToleranceEntry> entries;
    for (Found& found : found_) entries.push_back(std::move(found.entry));
    return entries;
  }

 private:
  /// An entry and where it stands.
  struct Found {
    size_t offset = 0;
    ToleranceEntry entry;
  };

  /// Reads the tolerances of one table. `deeper` is the only table that it may hold: "role" at the
  /// top, "label" in a role, none in a label.
  void ReadTable(const source::TomlValue::Table& table, const std::string& role,
                 const std::string& label, const std::string& deeper) {
    // Whatever is no table is taken for a tolerance, so that a misspelt name gets the hint for
    // names.
    for (const source::TomlEntry& entry : table) {
      const source::TomlValue::Table* inner = entry.value.table();
      if (inner == nullptr) {
        ReadEntry(entry, role, label);
      } else if (deeper.empty() || entry.key != deeper) {
        diagnostics_.Error(entry.key_span,
                           "a table of tolerances is called role.PATTERN or "
                           "role.PATTERN.label.PATTERN, not " +
                               entry.key);
      } else {
        ReadPatterns(*inner, role, deeper);
      }
    }
  }

  /// Reads the tables under `role` or `label`, each named by a pattern.
  void ReadPatterns(const source::TomlValue::Table& table, const std::string& role,
                    const std::string& kind) {
    for (const source::TomlEntry& entry : table) {
      const source::TomlValue::Table* inner = entry.value.table();
      if (inner == nullptr) {
        diagnostics_.Error(entry.key_span, "expected a table: [" + kind + "." + entry.key + "]");
      } else if (kind == "role") {
        ReadTable(*inner, entry.key, "*", "label");
      } else {
        ReadTable(*inner, role, entry.key, "");
      }
    }
  }

  /// Reads `name = value`.
  void ReadEntry(const source::TomlEntry& entry, const std::string& role,
                 const std::string& label) {
    const std::string& name = entry.key;
    // All names are gathered on the way, since the hint for an unknown one is chosen among them.
    std::vector<std::string> names;
    double Tolerances::*which = nullptr;
    for (const auto& [known, member] : ToleranceNames()) {
      names.push_back(known);
      if (known == name) which = member;
    }
    if (which == nullptr) {
      diagnostics_.Error(entry.key_span, "there is no tolerance '" + name + "'")
          .Hint(source::NearestHint(name, names, "docs/log.md lists them"));
      return;
    }
    // A number with a unit is a text in TOML; a date or a list is nothing.
    Result<double> value = Fail("a tolerance is a number, 0 or more");
    if (const std::string* text = entry.value.text()) value = ReadTolerance(name, *text);
    if (entry.value.is_number()) value = *entry.value.number();
    if (value && !(std::isfinite(*value) && *value >= 0)) {
      value = Fail("a tolerance is a number, 0 or more");
    }
    if (!value) {
      diagnostics_.Error(entry.value.span, value.error().message);
      return;
    }
    found_.push_back({entry.key_span.begin, {role, label, which, *value}});
  }

  source::Diagnostics& diagnostics_;
  std::vector<Found> found_;
};

}  // namespace

Tolerances AlignedTolerances() {
  // Half a degree for angles, and a degree for links, in which the angles of several joints add up.
  Tolerances t;
  t.propagated_m = 3e-3;
  t.propagated_rad = 1.745e-2;
  t.simulated_m = 3e-3;
  t.simulated_rad = 1.745e-2;
  t.angle_rad = 8.727e-3;
  t.travel_m = 1e-3;
  return t;
}

const std::vector<std::pair<std::string, double Tolerances::*>>& ToleranceNames() {
  // Options, files and documents name tolerances by these words.
  static const std::vector<std::pair<std::string, double Tolerances::*>> names = {
      {"propagated_m", &Tolerances::propagated_m},
      {"propagated_rad", &Tolerances::propagated_rad},
      {"simulated_m", &Tolerances::simulated_m},
      {"simulated_rad", &Tolerances::simulated_rad},
      {"angle_rad", &Tolerances::angle_rad},
      {"travel_m", &Tolerances::travel_m},
      {"velocity_rad_s", &Tolerances::velocity_rad_s},
      {"velocity_m_s", &Tolerances::velocity_m_s},
      {"effort_n_m", &Tolerances::effort_n_m},
      {"effort_n", &Tolerances::effort_n},
      {"command_rad", &Tolerances::command_rad},
      {"command_m", &Tolerances::command_m},
      {"role_s", &Tolerances::role_s},
      {"event_s", &Tolerances::event_s},
      {"drift_m", &Tolerances::drift_m},
      {"drift_rad", &Tolerances::drift_rad},
      {"cycle_s", &Tolerances::cycle_s},
      {"forward_m", &Tolerances::forward_m},
      {"sideways_m", &Tolerances::sideways_m},
      {"turn_rad", &Tolerances::turn_rad},
      {"height_m", &Tolerances::height_m},
      {"duty", &Tolerances::duty},
      {"range_rad", &Tolerances::range_rad},
      {"range_m", &Tolerances::range_m},
      {"energy", &Tolerances::energy},
      {"transport", &Tolerances::transport}};
  return names;
}

Result<double> ReadTolerance(std::string_view name, std::string_view text) {
  const auto is_one_of = [name](std::initializer_list<std::string_view> names) {
    return std::ranges::find(names, name) != names.end();
  };
  // The names end in their units, but for those of shares; rad_s and m_s are no seconds.
  std::optional<double> value;
  std::string expected = "a number, 0 or more";
  if (name.ends_with("_rad")) {
    value = ReadRadians(text);
    expected = "an angle, 0 or more, such as 0.01 or 0.5deg";
  } else if (is_one_of({"role_s", "event_s", "cycle_s"})) {
    value = ReadSeconds(text);
    expected = "a time, 0 or more, such as 0.1 or 100ms";
  } else if (text.ends_with('%') && is_one_of({"duty", "energy", "transport"})) {
    value = ReadFraction(text);
  } else {
    value = ReadPlainNumber(text);
  }
  if (value && *value >= 0) return *value;
  return Fail("expected " + expected);
}

bool ToleranceEntry::Fits(const std::string& role_name, const std::string& label_name) const {
  // Patterns are those of the shell: '*' also stands for a module without a role, whose name is
  // empty.
  return fnmatch(role.c_str(), role_name.c_str(), 0) == 0 &&
         fnmatch(label.c_str(), label_name.c_str(), 0) == 0;
}

std::vector<ToleranceEntry> ParseTolerances(const source::SourceSet& sources, int file,
                                            source::Diagnostics* diagnostics) {
  // The parser's own error is the only one of a text that is no TOML.
  const std::optional<source::TomlValue::Table> table =
      source::ParseToml(sources, file, diagnostics);
  return table ? ToleranceReader(diagnostics).Read(*table) : std::vector<ToleranceEntry>();
}

}  // namespace morphbus::logger
