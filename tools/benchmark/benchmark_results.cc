#include "tools/benchmark/benchmark_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

#include "compiler/base/text.h"
#include "tools/base/files.h"

namespace morphbus::tools {
namespace {

/// A line of the table: the robot, whether it meets the task, seven figures and the hash.
constexpr const char* kLine = "  {:<58} {:<5} {:>6} {:>9} {:>8} {:>7} {:>7} {:>8}  {}\n";
constexpr double kDegreesInARadian = 57.29577951308232;
/// By these a row is found again.
constexpr std::array<const char*, 5> kNames = {"task", "model", "robot", "program", "settings"};
/// What a run is made of, each with a hash in the row: "model_hash" …
constexpr std::array<const char*, 3> kInputs = {"model", "program", "world"};

std::string ResultsPath(const std::string& folder) { return folder + "/results.json"; }

/// "quadruped.best" of "../tuned/quadruped.best.toml".
std::string StemOf(const std::string& path) { return std::filesystem::path(path).stem().string(); }

/// A figure of a row with so many digits behind the point; "-" for what is not known.
std::string Cell(const Json& row, const char* figure, int digits, double factor = 1.0) {
  const Json& figures = row["figures"];
  const auto found = figures.find(figure);
  if (found == figures.end() || !found->is_number()) return "-";
  return fmt::format("{:.{}f}", found->get<double>() * factor, digits);
}

/// Whether a row of results.json is as RowJson makes them.
bool IsRow(const Json& row) {
  if (!row.is_object()) return false;
  const auto is = [&row](const char* key, bool (Json::*kind)() const noexcept) {
    const auto found = row.find(key);
    return found != row.end() && ((*found).*kind)();
  };
  const auto text_or_null = [&is](const char* key) {
    return is(key, &Json::is_string) || is(key, &Json::is_null);
  };
  // A run that failed has no hash, but says why.
  return std::ranges::all_of(
             kNames,
             [&](const char* name) {
               return is(name, &Json::is_string) ||
                      (name == std::string_view("settings") && is(name, &Json::is_null));
             }) &&
         std::ranges::all_of(kInputs,
                             [&](const char* input) {
                               return is((std::string(input) + "_hash").c_str(), &Json::is_string);
                             }) &&
         is("meant", &Json::is_boolean) && is("met", &Json::is_boolean) &&
         is("figures", &Json::is_object) && text_or_null("error") && text_or_null("hash") &&
         is("hash", &Json::is_string) != is("error", &Json::is_string);
}

/// Where in `rows` the one stands that has the names of `row`; behind all of them if none has.
size_t PlaceOf(const std::vector<Json>& rows, const Json& row) {
  const auto same = [&row](const Json& one) {
    return std::ranges::all_of(kNames, [&](const char* name) { return one[name] == row[name]; });
  };
  return static_cast<size_t>(std::ranges::find_if(rows, same) - rows.begin());
}

}  // namespace

BenchmarkRow RowOf(const BenchmarkTask& task, const BenchmarkRobot& robot) {
  BenchmarkRow row;
  row.task = &task;
  row.model = StemOf(robot.model);
  row.robot = robot.robot;
  row.program = StemOf(robot.program);
  if (!robot.params.empty()) row.settings = StemOf(robot.params);
  row.meant = std::ranges::find(robot.meets, task.name) != robot.meets.end();
  for (const std::string& setting : robot.set) {
    row.settings += (row.settings.empty() ? "" : " ") + setting;
  }
  return row;
}

Json RowJson(const BenchmarkRow& row) {
  const BenchmarkOutcome& outcome = row.outcome;
  return {{"task", row.task->name},
          {"model", row.model},
          {"robot", row.robot},
          {"program", row.program},
          {"settings", row.settings.empty() ? Json(nullptr) : Json(row.settings)},
          {"meant", row.meant},
          {"model_hash", row.model_hash},
          {"program_hash", row.program_hash},
          {"world_hash", row.world_hash},
          {"met", outcome.met},
          {"hash", outcome.hash.empty() ? Json(nullptr) : Json(outcome.hash)},
          {"figures", outcome.figures},
          {"error", outcome.error.empty() ? Json(nullptr) : Json(outcome.error)}};
}

Result<std::vector<Json>> ReadResults(const std::string& folder) {
  const std::string path = ResultsPath(folder);
  if (!std::filesystem::exists(path)) return std::vector<Json>();
  const Result<std::string> text = ReadFile(path, 16 << 20);
  if (!text) return Fail(text.error().message);
  // The file may have been edited, so that each row is looked at before anybody asks for its parts.
  const Json json = Json::parse(*text, nullptr, false);
  if (!json.is_array()) return Fail(path + ": expected a list of results");
  if (!std::ranges::all_of(json, IsRow)) {
    return Fail(path +
                ": a result lacks its task, model, robot, program, figures or a hash; remove the "
                "file, and --write makes it anew");
  }
  return std::vector<Json>(json.begin(), json.end());
}

Result<void> WriteResults(const Benchmark& benchmark, const std::vector<BenchmarkRow>& rows) {
  Result<std::vector<Json>> results = ReadResults(benchmark.folder);
  if (!results) return tl::unexpected(results.error());
  // What has been run now takes the place of what the file had of it.
  for (const BenchmarkRow& row : rows) {
    const Json fresh = RowJson(row);
    const size_t place = PlaceOf(*results, fresh);
    if (place == results->size()) results->emplace_back();
    (*results)[place] = fresh;
  }
  // In the order in which all of them would run, whichever were asked for first. Rows of what is no
  // longer there come last.
  std::vector<Json> order;
  for (const BenchmarkTask& task : benchmark.tasks) {
    for (const BenchmarkRobot& robot : benchmark.robots) {
      order.push_back(RowJson(RowOf(task, robot)));
    }
  }
  std::ranges::stable_sort(*results, {}, [&order](const Json& row) { return PlaceOf(order, row); });
  // A line a row, so that a change of one is a change of one line.
  std::string text = "[";
  for (const Json& row : *results) {
    text += (text.size() > 1 ? ",\n " : "\n ") + JsonText(row);
  }
  return WriteFile(ResultsPath(benchmark.folder), text + "\n]\n");
}

const Json* FindResult(const std::vector<Json>& results, const BenchmarkRow& row) {
  const size_t place = PlaceOf(results, RowJson(row));
  return place == results.size() ? nullptr : &results[place];
}

std::vector<std::string> OtherInputs(const BenchmarkRow& row, const Json& known) {
  // Both are asked by the same names, so that a row and its file cannot come to mean different
  // things.
  const Json now = RowJson(row);
  std::vector<std::string> others;
  for (const std::string input : kInputs) {
    if (now[input + "_hash"] != known[input + "_hash"]) others.push_back(input);
  }
  return others;
}

std::string TaskHeading(const BenchmarkTask& task) {
  return fmt::format("{} ({})\n", task.title, task.name) +
         fmt::format(kLine, "model: robot, program", "met", "s", "distance", "drift", "turned",
                     "m/s", "J", "hash");
}

std::string RowText(const Json& row) {
  const std::string settings =
      row["settings"].is_null() ? "" : ", " + row["settings"].get<std::string>();
  const std::string who = EscapeControl(fmt::format("{}: {}, {}{}", row["model"].get<std::string>(),
                                                    row["robot"].get<std::string>(),
                                                    row["program"].get<std::string>(), settings));
  // What the robot is not meant to meet stands in parentheses, whatever it does.
  const char* const met = row["meant"].get<bool>() ? (row["met"].get<bool>() ? "yes" : "no")
                                                   : (row["met"].get<bool>() ? "(yes)" : "(no)");
  if (row["hash"].is_null()) {
    return fmt::format("  {:<58} failed: {}\n", who,
                       EscapeControl(row["error"].get<std::string>()));
  }
  return fmt::format(kLine, who, met, Cell(row, "seconds", 0), Cell(row, "distance", 3) + " m",
                     Cell(row, "drift", 2) + " m", Cell(row, "turned", 0, kDegreesInARadian) + "°",
                     Cell(row, "speed", 4), Cell(row, "energy", 1), row["hash"].get<std::string>());
}

}  // namespace morphbus::tools
