// Text and JSON of a comparison (logger/compare/comparer.h).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "logger/compare/comparer.h"
#include "logger/compare/source_trace.h"
#include "logger/log/text_lines.h"

namespace morphbus::logger {
namespace {

/// Whether `us` is a time, and earlier than `other` (µs; -1 for a time that never came).
bool Earlier(int64_t us, int64_t other) { return us >= 0 && (other < 0 || us < other); }

/// Adds an item to those of its quantity; `sum` keeps the label of the largest difference, which
/// says where that was.
void AddTo(const Item& item, Item* sum) {
  // The RMS of two sets of samples, from the RMS of each.
  const auto squares = [](const Item& i) { return i.rms * i.rms * static_cast<double>(i.samples); };
  const double n = static_cast<double>(sum->samples + item.samples);
  if (n > 0) sum->rms = std::sqrt((squares(*sum) + squares(item)) / n);
  sum->samples += item.samples;
  sum->missing += item.missing;
  if (item.max > sum->max) {
    sum->max = item.max;
    sum->max_time_us = item.max_time_us;
    sum->label = item.label;
  }
  if (Earlier(item.first_over_us, sum->first_over_us)) sum->first_over_us = item.first_over_us;
}

/// A sim time (µs) in seconds; null for a time that never came.
nlohmann::json NullOrTime(int64_t us) {
  return us < 0 ? nlohmann::json(nullptr) : nlohmann::json(Seconds(us));
}

/// What an item is of, and by how much it may differ.
nlohmann::json SubjectJson(const Item& item) {
  return {{"role", item.role},   {"quantity", QuantityName(item.quantity)},
          {"label", item.label}, {"a", item.module_a},
          {"b", item.module_b},  {"tolerance", item.tolerance},
          {"unit", item.unit},   {"detail", item.detail}};
}

/// The first divergence, with the difference at that time in place of the largest one.
nlohmann::json FirstJson(const Item& item) {
  nlohmann::json json = SubjectJson(item);
  json["time"] = Seconds(item.first_over_us);
  json["difference"] = item.first_over;
  return json;
}

/// The largest difference, in SI units, and times in seconds.
nlohmann::json FiguresJson(const Item& item) {
  return {{"max", item.max},
          {"rms", item.rms},
          {"unit", item.unit},
          {"max_time", Seconds(item.max_time_us)},
          {"tolerance", item.tolerance},
          {"first_over", NullOrTime(item.first_over_us)}};
}

/// One of the `items`.
nlohmann::json ItemJson(const Item& item) {
  nlohmann::json json = SubjectJson(item);
  json.update(FiguresJson(item));
  json["samples"] = item.samples;
  json["missing"] = item.missing;
  return json;
}

/// "ACTUATOR" of "walk/m1/ACTUATOR".
std::string TopicOfChannel(const std::string& channel) {
  return channel.substr(channel.rfind('/') + 1);
}

/// What one run says of the message that differs.
nlohmann::json TracedJson(const TracedMessage& message) {
  // A run without such a message has neither channel nor tick. File, line and function stay null
  // unless a call of the program asked for the message.
  nlohmann::json json = {
      {"channel",
       message.channel.empty() ? nlohmann::json(nullptr) : nlohmann::json(message.channel)},
      {"tick", message.tick < 0 ? nlohmann::json(nullptr) : nlohmann::json(message.tick)},
      {"file", nullptr},
      {"line", nullptr},
      {"function", nullptr},
      {"why_not", message.why_not}};
  if (message.line) {
    json["file"] = message.line->file;
    json["line"] = message.line->line;
    json["function"] = message.line->function;
  }
  return json;
}

/// The message from which the divergence comes.
nlohmann::json TraceJson(const Comparison& comparison) {
  if (!comparison.trace) return nullptr;
  const Item& item = comparison.items[comparison.trace->item];
  nlohmann::json json = FirstJson(item);
  json["message_a"] = TracedJson(comparison.trace->a);
  json["message_b"] = TracedJson(comparison.trace->b);
  return json;
}

/// How B's times were brought onto A's.
nlohmann::json AlignmentJson(const Alignment& alignment) {
  return {{"by", AlignName(alignment.how)},
          {"by_ticks", alignment.by_ticks},
          {"lag", Seconds(alignment.lag_us)},
          {"least_shift", Seconds(alignment.least_shift_us)},
          {"most_shift", Seconds(alignment.most_shift_us)},
          {"events", alignment.events}};
}

/// Which log was compared.
nlohmann::json LogJson(const LogFacts& log) {
  return {{"path", log.path},
          {"run", log.run},
          {"robot", log.robot_name},
          {"program", log.program_file},
          {"hash", log.run_hash},
          {"seconds", log.seconds},
          {"end", EndStateName(log.end_state)}};
}

/// The commands of both runs, a line each, with their ticks.
void AddCommands(const Comparison& comparison, std::string* text) {
  if (comparison.commands.empty()) return;
  AddLine(text, "commands while they ran (tick in A, tick in B, command):");
  const auto tick = [](const std::optional<int64_t>& t) { return t ? std::to_string(*t) : "-"; };
  for (const CommandPair& pair : comparison.commands) {
    // Where they differ is seen at the margin.
    AddLine(text, "{} {:>7} {:>7}  {}", Differs(pair, CommandsByTicks(comparison)) ? "!" : " ",
            tick(pair.tick_a), tick(pair.tick_b), pair.text);
  }
}

/// The same for scripts; null stands for the run that did not have it.
nlohmann::json CommandsJson(const Comparison& comparison) {
  const auto tick = [](const std::optional<int64_t>& t) {
    return t ? nlohmann::json(*t) : nlohmann::json(nullptr);
  };
  nlohmann::json commands = nlohmann::json::array();
  for (const CommandPair& pair : comparison.commands) {
    commands.push_back({{"command", pair.text},
                        {"tick_a", tick(pair.tick_a)},
                        {"tick_b", tick(pair.tick_b)},
                        {"differs", Differs(pair, CommandsByTicks(comparison))}});
  }
  return commands;
}

/// The settings in which the runs differ; null stands for the run without it.
nlohmann::json SettingsJson(const Comparison& comparison) {
  const auto value = [](const std::optional<std::string>& text) {
    return text ? nlohmann::json(*text) : nlohmann::json(nullptr);
  };
  nlohmann::json settings = nlohmann::json::array();
  for (const SettingPair& pair : comparison.settings) {
    settings.push_back({{"name", pair.name}, {"a", value(pair.a)}, {"b", value(pair.b)}});
  }
  return settings;
}

/// At the gait level, the figures of both runs.
void AddFigures(const Comparison& comparison, std::string* text) {
  for (const auto& [figures, which] :
       {std::pair(&comparison.figures_a, "A"), std::pair(&comparison.figures_b, "B")}) {
    // At the sample level there are none.
    if (!*figures) continue;
    for (const auto& [name, value] : FigureLines(**figures)) {
      AddLine(text, "  {}: {:<16} {}", which, name, value);
    }
  }
}

/// The message from which the divergence comes, and who sent it.
void AddTrace(const Comparison& comparison, std::string* text) {
  if (!comparison.trace) return;
  const Trace& trace = *comparison.trace;
  const Item& item = comparison.items[trace.item];
  AddLine(text, "earliest message that differs: {} at {:.3f} s, {} of {}{}{}",
          TopicOfChannel(trace.a.channel.empty() ? trace.b.channel : trace.a.channel),
          Seconds(item.first_over_us), QuantityName(item.quantity), RoleName(item.role),
          item.label.empty() ? "" : " ", item.label);
  for (const auto& [message, which] : {std::pair(&trace.a, "A"), std::pair(&trace.b, "B")}) {
    // Of a command either the call is known or why it is not; of what no program sends there is
    // neither.
    std::string what =
        message->line ? "sent by " + SourceLineText(*message->line) : message->why_not;
    if (!what.empty()) what = ", " + what;
    if (message->tick < 0) {
      AddLine(text, "  {}: no such message{}", which, what);
    } else {
      AddLine(text, "  {}: {} of tick {}{}", which, message->channel, message->tick, what);
    }
  }
}

}  // namespace

const char* VerdictName(Verdict verdict) {
  static constexpr const char* kNames[] = {"equivalent", "different", "unusable"};
  return kNames[static_cast<int>(verdict)];
}

std::string RoleName(const std::string& role) { return role.empty() ? "(no role)" : role; }

DisplayUnit DisplayUnitOf(const std::string& unit) {
  // Lengths are read in millimetres and angles in degrees; times stay in seconds.
  if (unit == "m") return {"mm", 1e3};
  if (unit == "rad") return {"deg", kDegrees};
  if (unit == "m/s") return {"mm/s", 1e3};
  if (unit == "rad/s") return {"deg/s", kDegrees};
  if (unit == "share") return {"%", 100.0};
  if (unit == "N m" || unit == "N") return {unit == "N" ? "N" : "N m", 1.0};
  return {unit == "s" ? "s" : "", 1.0};
}

std::string NumberText(double value, const std::string& unit) {
  // A count has no decimals.
  if (unit.empty()) return fmt::format("{:.0f}", value);
  const double shown = value * DisplayUnitOf(unit).scale;
  // Three decimals must not turn a small difference into none; less than 1e-7 is what rounding
  // leaves.
  if (std::abs(shown) >= 1e-7 && std::abs(shown) < 5e-4) return shown < 0 ? ">-0.001" : "<0.001";
  return fmt::format("{:.3f}", shown);
}

std::string ValueText(double value, const std::string& unit) {
  const std::string name = DisplayUnitOf(unit).name;
  return NumberText(value, unit) + (name.empty() ? "" : " ") + name;
}

std::map<std::string, RoleFigures> FiguresByRole(const Comparison& comparison) {
  std::map<std::string, RoleFigures> roles;
  // Every role that a pair plays gets an entry, whether or not anything of it was compared.
  for (const ModulePair& pair : comparison.matching.pairs) roles[pair.role];
  for (const Item& item : comparison.items) {
    RoleFigures& role = roles[item.role];
    // The first item of a quantity is taken as it is; the others are added to it.
    const auto [at, fresh] = role.worst.try_emplace(item.quantity, item);
    if (!fresh) AddTo(item, &at->second);
    // The role as a whole: its largest length and angle, and when it was first beyond a tolerance.
    if (item.unit == "m") role.max_position_m = std::max(role.max_position_m, item.max);
    if (item.unit == "rad") role.max_rotation_rad = std::max(role.max_rotation_rad, item.max);
    if (Earlier(item.first_over_us, role.first_over_us)) role.first_over_us = item.first_over_us;
    // Each pair of modules has exactly one item without a label that says when it took the role.
    if (item.quantity == Quantity::kRole && item.label.empty()) {
      role.modules.emplace_back(item.module_a, item.module_b);
    }
  }
  return roles;
}

namespace {

/// "12.3 mm   4.5 mm   10.0 mm  beyond it from": the columns behind a table's names.
std::string ItemColumns(const Item& item) {
  return fmt::format(
      "{:>14} {:>14} {:>14}  {}", ValueText(item.max, item.unit), ValueText(item.rms, item.unit),
      ValueText(item.tolerance, item.unit),
      item.first_over_us < 0 ? "" : fmt::format("{:.3f} s", Seconds(item.first_over_us)));
}

/// A line for each quantity of a role; the role's name stands in the first one only.
std::string TableByRole(const Comparison& comparison) {
  std::string text;
  AddLine(&text, "  {:<28} {:<20} {:>14} {:>14} {:>14}  {}", "role", "quantity", "largest", "RMS",
          "tolerance", "beyond it from");
  for (const auto& [role, figures] : FiguresByRole(comparison)) {
    std::string name = RoleName(role);
    for (const auto& [quantity, item] : figures.worst) {
      AddLine(&text, "  {:<28} {:<20} {}", name, QuantityName(quantity), ItemColumns(item));
      name.clear();
    }
  }
  return text;
}

/// A line for each quantity: the role that is furthest from or beyond the tolerance, measured by
/// it, and how many roles are beyond.
std::string TableByQuantity(const Comparison& comparison) {
  struct Row {
    const Item* item = nullptr;
    std::string role;
    int roles = 0, beyond = 0;
  };
  const std::map<std::string, RoleFigures> roles = FiguresByRole(comparison);
  std::map<Quantity, Row> rows;
  for (const auto& [role, figures] : roles) {
    for (const auto& [quantity, item] : figures.worst) {
      Row& row = rows[quantity];
      ++row.roles;
      row.beyond += item.first_over_us >= 0 ? 1 : 0;
      // What is beyond comes before what is not, and the earlier before the later, as in "first
      // divergence".
      const bool first =
          row.item == nullptr || Earlier(item.first_over_us, row.item->first_over_us) ||
          (item.first_over_us == row.item->first_over_us && item.max > row.item->max);
      if (!first) continue;
      row.item = &item;
      row.role = RoleName(role);
    }
  }
  std::string text;
  AddLine(&text, "  {:<20} {:>14} {:>14} {:>14}  {}", "quantity", "largest", "RMS", "tolerance",
          "beyond it from");
  for (const auto& [quantity, row] : rows) {
    const std::string of = row.beyond > 0 ? fmt::format(" ({}; {} of {} beyond)", row.role,
                                                        row.beyond, Counted(row.roles, "role"))
                                          : "";
    AddLine(&text, "  {:<20} {}{}", QuantityName(quantity), ItemColumns(*row.item), of);
  }
  AddLine(&text,
          "  of all roles the one that differs first or most; --all has every role's figures");
  return text;
}

}  // namespace

std::string ComparisonText(const Comparison& comparison, bool all) {
  // Runs of other settings are not expected to be alike: that comes before the verdict. Then which
  // logs were compared, and what must be known besides.
  std::string text;
  if (!comparison.settings.empty()) AddLine(&text, "{}", SettingsText(comparison.settings));
  AddLine(&text, "{}: {}", VerdictName(comparison.verdict), comparison.reason);
  for (const auto& [log, which] : {std::pair(&comparison.a, "A"), std::pair(&comparison.b, "B")}) {
    AddLine(&text, "  {} = {} (run {}, robot {}, {:.3f} s)", which, log->path,
            log->run.empty() ? "?" : log->run, log->robot_name.empty() ? "?" : log->robot_name,
            log->seconds);
  }
  // Notes and gaps come before the figures, which they may put in doubt.
  for (const std::string& note : comparison.notes) AddLine(&text, "  note: {}", note);
  for (const std::string& what : comparison.not_compared) {
    AddLine(&text, "  not compared: {}", what);
  }
  // The item that is first beyond its tolerance, with where it is and by how much.
  if (comparison.first) {
    const Item& item = comparison.items[*comparison.first];
    const std::string modules =
        item.module_a.empty() && item.module_b.empty()
            ? ""
            : fmt::format(" ({} / {})", item.module_a.empty() ? "-" : item.module_a,
                          item.module_b.empty() ? "-" : item.module_b);
    AddLine(&text, "first divergence: {:.3f} s, {} of {}{}{}{}: {} (tolerance {}){}{}",
            Seconds(item.first_over_us), QuantityName(item.quantity), RoleName(item.role),
            item.label.empty() ? "" : " ", item.label, modules,
            ValueText(item.first_over, item.unit), ValueText(item.tolerance, item.unit),
            item.detail.empty() ? "" : "; ", item.detail);
  }
  AddFigures(comparison, &text);
  AddTrace(comparison, &text);
  AddCommands(comparison, &text);
  // Logs of which nothing could be compared have no table.
  if (!comparison.items.empty())
    text += "\n" + (all ? TableByRole(comparison) : TableByQuantity(comparison));
  return text;
}

nlohmann::json ComparisonJson(const Comparison& comparison) {
  // Figures of each role, then which modules play it, then every item.
  nlohmann::json roles = nlohmann::json::object();
  for (const auto& [role, figures] : FiguresByRole(comparison)) {
    nlohmann::json entry = {{"modules", nlohmann::json::array()},
                            {"max_position_m", figures.max_position_m},
                            {"max_rotation_rad", figures.max_rotation_rad},
                            {"first_over", NullOrTime(figures.first_over_us)},
                            {"quantities", nlohmann::json::object()}};
    // The item with the largest difference stands for its quantity.
    for (const auto& [quantity, item] : figures.worst) {
      entry["quantities"][QuantityName(quantity)] = FiguresJson(item);
    }
    // A module that only one run has stands beside null.
    const auto name = [](const std::string& module) {
      return module.empty() ? nlohmann::json(nullptr) : nlohmann::json(module);
    };
    for (const auto& [a, b] : figures.modules) {
      entry["modules"].push_back({{"a", name(a)}, {"b", name(b)}});
    }
    roles[role] = std::move(entry);
  }
  // The items stand as they were found; a script that wants other sums can make them from these.
  nlohmann::json items = nlohmann::json::array();
  for (const Item& item : comparison.items) items.push_back(ItemJson(item));
  // Without a first divergence its key is there, and null.
  nlohmann::json json = {
      {"verdict", VerdictName(comparison.verdict)},
      {"reason", comparison.reason},
      {"a", LogJson(comparison.a)},
      {"b", LogJson(comparison.b)},
      {"compared_seconds", Seconds(comparison.compared_until_us)},
      {"roles", std::move(roles)},
      {"max_position_m", comparison.max_position_m},
      {"max_rotation_rad", comparison.max_rotation_rad},
      {"first_divergence",
       comparison.first ? FirstJson(comparison.items[*comparison.first]) : nlohmann::json(nullptr)},
      {"items", std::move(items)},
      {"not_compared", comparison.not_compared},
      {"notes", comparison.notes},
      {"settings", SettingsJson(comparison)},
      {"commands", CommandsJson(comparison)},
      {"trace", TraceJson(comparison)},
      {"level", comparison.level == Level::kGait ? "gait" : "sample"},
      {"align", AlignmentJson(comparison.alignment)}};
  // The gaits' figures are there at the gait level only, and so are their keys.
  if (comparison.figures_a && comparison.figures_b) {
    json["gait"] = {{"a", GaitJson(comparison.figures_a->gait)},
                    {"b", GaitJson(comparison.figures_b->gait)}};
    json["figures"] = {{"a", FiguresJson(*comparison.figures_a)},
                       {"b", FiguresJson(*comparison.figures_b)}};
  }
  return json;
}

}  // namespace morphbus::logger
