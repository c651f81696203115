#include "logger/compare/setting_pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace morphbus::logger {
namespace {

/// So many are named as text; a damaged log may say anything.
constexpr size_t kMostNamed = 20;

/// The settings of a run by name: the values of its parameters, and what was set of the model, of
/// which the later one counts.
std::map<std::string, std::string> SettingsOf(const LogFacts& facts) {
  std::map<std::string, std::string> settings;
  for (const dynarole::ProgramParameter& p : facts.parameters) settings[p.name] = p.Text(p.value);
  for (const std::string& text : facts.attributes) {
    const size_t equals = std::min(text.find('='), text.size());
    settings[text.substr(0, equals)] = text.substr(std::min(equals + 1, text.size()));
  }
  return settings;
}

}  // namespace

std::vector<SettingPair> DifferingSettings(const LogFacts& a, const LogFacts& b) {
  const std::map<std::string, std::string> of_a = SettingsOf(a), of_b = SettingsOf(b);
  std::map<std::string, SettingPair> pairs;
  for (const auto& [name, value] : of_a) pairs[name] = {name, value, std::nullopt};
  for (const auto& [name, value] : of_b) {
    pairs.try_emplace(name, SettingPair{name, std::nullopt, std::nullopt}).first->second.b = value;
  }
  std::vector<SettingPair> differing;
  for (auto& [name, pair] : pairs) {
    if (pair.a != pair.b) differing.push_back(std::move(pair));
  }
  return differing;
}

std::string SettingsText(const std::vector<SettingPair>& settings) {
  std::string text;
  for (size_t i = 0; i < std::min(settings.size(), kMostNamed); ++i) {
    const SettingPair& pair = settings[i];
    text += fmt::format("{}{} {} / {}", text.empty() ? "differs in parameters: " : ", ", pair.name,
                        pair.a.value_or("-"), pair.b.value_or("-"));
  }
  if (settings.size() > kMostNamed) {
    text += fmt::format(" and {} more", settings.size() - kMostNamed);
  }
  return text;
}

}  // namespace morphbus::logger
