// Text and JSON of a comparison (logger/comparer.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "logger/comparer.h"

namespace morphbus::logger {
namespace {

double Seconds(int64_t us) { return static_cast<double>(us) * 1e-6; }

/// Largest differences of one role, by quantity.
struct RoleFigures {
  std::map<Quantity, Item> worst;  ///< rms: of all its items together.
  double max_position_m = 0.0;
  double max_rotation_rad = 0.0;
  int64_t first_over_us = -1;
};

std::map<std::string, RoleFigures> FiguresByRole(const Comparison& comparison) {
  std::map<std::string, RoleFigures> roles;
  for (const ModulePair& pair : comparison.matching.pairs) roles[pair.role];
  for (const Item& item : comparison.items) {
    RoleFigures& role = roles[item.role];
    const auto [at, fresh] = role.worst.try_emplace(item.quantity, item);
    if (!fresh) {
      Item& sum = at->second;
      const double n = static_cast<double>(sum.samples + item.samples);
      if (n > 0) {
        sum.rms = std::sqrt((sum.rms * sum.rms * static_cast<double>(sum.samples) +
                             item.rms * item.rms * static_cast<double>(item.samples)) /
                            n);
      }
      sum.samples += item.samples;
      sum.missing += item.missing;
      if (item.max > sum.max) {
        sum.max = item.max;
        sum.max_time_us = item.max_time_us;
        sum.label = item.label;
      }
      if (item.first_over_us >= 0 &&
          (sum.first_over_us < 0 || item.first_over_us < sum.first_over_us)) {
        sum.first_over_us = item.first_over_us;
      }
    }
    if (item.unit == "m") role.max_position_m = std::max(role.max_position_m, item.max);
    if (item.unit == "rad") role.max_rotation_rad = std::max(role.max_rotation_rad, item.max);
    if (item.first_over_us >= 0 &&
        (role.first_over_us < 0 || item.first_over_us < role.first_over_us)) {
      role.first_over_us = item.first_over_us;
    }
  }
  return roles;
}

/// With a unit that people read: mm, degrees, s.
std::string Readable(double value, const std::string& unit) {
  if (unit == "m") return fmt::format("{:.3f} mm", value * 1e3);
  if (unit == "rad") return fmt::format("{:.3f} deg", value * 180.0 / std::numbers::pi);
  return fmt::format("{:.3f} s", value);
}

nlohmann::json NullOrTime(int64_t us) {
  return us < 0 ? nlohmann::json(nullptr) : nlohmann::json(Seconds(us));
}

nlohmann::json FirstJson(const Item& item) {
  return {{"time", Seconds(item.first_over_us)},
          {"role", item.role},
          {"quantity", QuantityName(item.quantity)},
          {"label", item.label},
          {"a", item.module_a},
          {"b", item.module_b},
          {"difference", item.first_over},
          {"tolerance", item.tolerance},
          {"unit", item.unit},
          {"detail", item.detail}};
}

nlohmann::json ItemJson(const Item& item) {
  return {{"role", item.role},
          {"quantity", QuantityName(item.quantity)},
          {"label", item.label},
          {"a", item.module_a},
          {"b", item.module_b},
          {"unit", item.unit},
          {"max", item.max},
          {"max_time", Seconds(item.max_time_us)},
          {"rms", item.rms},
          {"tolerance", item.tolerance},
          {"samples", item.samples},
          {"missing", item.missing},
          {"first_over", NullOrTime(item.first_over_us)},
          {"detail", item.detail}};
}

nlohmann::json LogJson(const ComparedLog& log) {
  return {{"path", log.path},
          {"run", log.run},
          {"robot", log.robot},
          {"program", log.program_file},
          {"hash", log.run_hash},
          {"seconds", log.seconds},
          {"end", EndStateName(log.end_state)}};
}

}  // namespace

const char* VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kEquivalent:
      return "equivalent";
    case Verdict::kDifferent:
      return "different";
    case Verdict::kUnusable:
      return "unusable";
  }
  return "unusable";
}

const char* QuantityName(Quantity quantity) {
  switch (quantity) {
    case Quantity::kRole:
      return "role";
    case Quantity::kPropagatedPosition:
      return "propagated position";
    case Quantity::kPropagatedRotation:
      return "propagated rotation";
    case Quantity::kSimulatedPosition:
      return "simulated position";
    case Quantity::kSimulatedRotation:
      return "simulated rotation";
    case Quantity::kJointAngle:
      return "joint angle";
    case Quantity::kJointTravel:
      return "joint travel";
    case Quantity::kCommand:
      return "command";
    case Quantity::kRestPosition:
      return "rest position";
    case Quantity::kDuration:
      return "duration";
  }
  return "";
}

std::string ComparisonText(const Comparison& comparison) {
  std::string text = fmt::format("{}: {}\n", VerdictName(comparison.verdict), comparison.reason);
  for (const auto& [log, which] : {std::pair(&comparison.a, "A"), std::pair(&comparison.b, "B")}) {
    text += fmt::format("  {} = {} (run {}, robot {}, {:.3f} s)\n", which, log->path,
                        log->run.empty() ? "?" : log->run, log->robot.empty() ? "?" : log->robot,
                        log->seconds);
  }
  for (const std::string& note : comparison.notes) text += "  note: " + note + "\n";
  if (comparison.first) {
    const Item& item = comparison.items[*comparison.first];
    text += fmt::format("first divergence: {:.3f} s, {} of {}{}{}{}{}: {} (tolerance {}){}{}\n",
                        Seconds(item.first_over_us), QuantityName(item.quantity),
                        item.role.empty() ? "(no role)" : item.role, item.label.empty() ? "" : " ",
                        item.label, item.module_a.empty() && item.module_b.empty() ? "" : " ",
                        item.module_a.empty() && item.module_b.empty()
                            ? ""
                            : fmt::format("({} / {})", item.module_a.empty() ? "-" : item.module_a,
                                          item.module_b.empty() ? "-" : item.module_b),
                        Readable(item.first_over, item.unit), Readable(item.tolerance, item.unit),
                        item.detail.empty() ? "" : "; ", item.detail);
  }
  if (comparison.items.empty()) return text;
  text += fmt::format("\n  {:<28} {:<20} {:>14} {:>14} {:>14}  {}\n", "role", "quantity", "largest",
                      "RMS", "tolerance", "beyond it from");
  for (const auto& [role, figures] : FiguresByRole(comparison)) {
    std::string name = role.empty() ? "(no role)" : role;
    for (const auto& [quantity, item] : figures.worst) {
      text += fmt::format(
          "  {:<28} {:<20} {:>14} {:>14} {:>14}  {}\n", name, QuantityName(quantity),
          Readable(item.max, item.unit), Readable(item.rms, item.unit),
          Readable(item.tolerance, item.unit),
          item.first_over_us < 0 ? "" : fmt::format("{:.3f} s", Seconds(item.first_over_us)));
      name.clear();
    }
  }
  return text;
}

nlohmann::json ComparisonJson(const Comparison& comparison) {
  nlohmann::json roles = nlohmann::json::object();
  for (const auto& [role, figures] : FiguresByRole(comparison)) {
    nlohmann::json entry = {{"modules", nlohmann::json::array()},
                            {"max_position_m", figures.max_position_m},
                            {"max_rotation_rad", figures.max_rotation_rad},
                            {"first_over", NullOrTime(figures.first_over_us)},
                            {"quantities", nlohmann::json::object()}};
    for (const auto& [quantity, item] : figures.worst) {
      entry["quantities"][QuantityName(quantity)] = {
          {"max", item.max},
          {"rms", item.rms},
          {"unit", item.unit},
          {"max_time", Seconds(item.max_time_us)},
          {"tolerance", item.tolerance},
          {"first_over", NullOrTime(item.first_over_us)}};
    }
    roles[role] = std::move(entry);
  }
  for (const Item& item : comparison.items) {
    // Each pair of modules has exactly one item without a label that says when it took the role.
    if (item.quantity != Quantity::kRole || !item.label.empty()) continue;
    roles[item.role]["modules"].push_back(
        {{"a", item.module_a.empty() ? nlohmann::json(nullptr) : nlohmann::json(item.module_a)},
         {"b", item.module_b.empty() ? nlohmann::json(nullptr) : nlohmann::json(item.module_b)}});
  }
  nlohmann::json items = nlohmann::json::array();
  for (const Item& item : comparison.items) items.push_back(ItemJson(item));
  return {{"verdict", VerdictName(comparison.verdict)},
          {"reason", comparison.reason},
          {"a", LogJson(comparison.a)},
          {"b", LogJson(comparison.b)},
          {"compared_seconds", Seconds(comparison.compared_until_us)},
          {"roles", std::move(roles)},
          {"max_position_m", comparison.max_position_m},
          {"max_rotation_rad", comparison.max_rotation_rad},
          {"first_divergence", comparison.first ? FirstJson(comparison.items[*comparison.first])
                                                : nlohmann::json(nullptr)},
          {"items", std::move(items)},
          {"notes", comparison.notes}};
}

}  // namespace morphbus::logger
