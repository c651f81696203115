#pragma once
// In which settings two runs differ: parameters of their programs and attributes of their models.

#include <optional>
#include <string>
#include <vector>

#include "logger/log/run_facts.h"

namespace morphbus::logger {

/// A setting that two runs do not share.
struct SettingPair {
  /// "Leg.swing", a parameter's; with two dots an attribute's.
  std::string name;
  /// The value in each run, as text; none where the run has no such parameter, or leaves the
  /// attribute as the model has it.
  std::optional<std::string> a, b;
};

/// Parameters and attributes whose values differ, by name.
std::vector<SettingPair> DifferingSettings(const LogFacts& a, const LogFacts& b);

/// "differs in parameters: swing 30 / 45, lift - / 5"; empty if nothing differs.
std::string SettingsText(const std::vector<SettingPair>& settings);

}  // namespace morphbus::logger
