#include "logger/compare/setting_pairs.h"

#include <fmt/format.h>

#include <algorithm>

namespace morphbus::logger {
namespace {

/// A setting of one run: name and value.
using Named = std::pair<std::string, std::string>;

/// All of a run: the values of its parameters, then what was set of the model.
std::vector<Named> SettingsOf(const LogFacts& facts) {
  std::vector<Named> settings;
  for (const dynarole::ProgramParameter& p : facts.parameters) {
    settings.emplace_back(p.name, p.Text(p.value));
  }
  for (const std::string& text : facts.attributes) {
    const size_t equals = text.find('=');
    // Of two settings of one attribute the later one counts.
    const std::string name = text.substr(0, equals);
    std::erase_if(settings, [&](const Named& earlier) { return earlier.first == name; });
    settings.emplace_back(name, equals == std::string::npos ? "" : text.substr(equals + 1));
  }
  return settings;
}

std::optional<std::string> Find(const std::vector<Named>& settings, const std::string& name) {
  const auto found = std::ranges::find(settings, name, &Named::first);
  return found == settings.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

std::vector<SettingPair> DifferingSettings(const LogFacts& a, const LogFacts& b) {
  const std::vector<Named> of_a = SettingsOf(a), of_b = SettingsOf(b);
  std::vector<SettingPair> pairs;
  for (const auto& [name, value] : of_a) {
    const std::optional<std::string> other = Find(of_b, name);
    if (other != value) pairs.push_back({name, value, other});
  }
  for (const auto& [name, value] : of_b) {
    if (!Find(of_a, name)) pairs.push_back({name, std::nullopt, value});
  }
  return pairs;
}

std::string SettingsText(const std::vector<SettingPair>& settings) {
  std::string text;
  for (const SettingPair& pair : settings) {
    text += fmt::format("{}{} {} / {}", text.empty() ? "differs in parameters: " : ", ", pair.name,
                        pair.a.value_or("-"), pair.b.value_or("-"));
  }
  return text;
}

}  // namespace morphbus::logger
