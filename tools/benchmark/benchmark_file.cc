#include "tools/benchmark/benchmark_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <string_view>

#include "bridge/control/control_command.h"
#include "compiler/source/toml.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;
using source::TomlEntry;
using source::TomlValue;

constexpr const char* kRobots = "robots.toml";
/// The longest run, s: what a robot did is kept in memory, tick by tick.
constexpr double kMostSeconds = 1e4;

/// A figure of a task, with its unit as FigureExpression::UnitOf has it.
struct Figure {
  std::string_view name, unit;
  bool at_the_end;  ///< Only the end of the run tells it.
};
constexpr std::array<Figure, 17> kFigures = {{{"seconds", "s", false},
                                              {"distance", "m", false},
                                              {"north", "m", false},
                                              {"up", "m", false},
                                              {"east", "m", false},
                                              {"turned", "rad", false},
                                              {"spot", "m", false},
                                              {"speed", "m/s", true},
                                              {"drift", "m", true},
                                              {"energy", "J", true},
                                              {"cost_of_transport", "1", true},
                                              {"max_tilt", "rad", true},
                                              {"num_faults", "1", true},
                                              {"speed_before", "m/s", true},
                                              {"speed_after", "m/s", true},
                                              {"height_before", "m", true},
                                              {"height_after", "m", true}}};

/// The unit of a figure; empty for a name of none, of which something else is told.
std::string_view UnitOfTaskFigure(const std::string& name) {
  const auto figure = std::ranges::find(kFigures, name, &Figure::name);
  return figure == kFigures.end() ? "" : figure->unit;
}

/// Whether a table has all of these keys. What they say may be wrong, which is told at its place.
bool HasAll(const TomlValue::Table& table, std::initializer_list<const char*> keys) {
  return std::ranges::all_of(keys, [&table](const char* key) {
    return std::ranges::find(table, key, &TomlEntry::key) != table.end();
  });
}

/// Reads the tree of one file, whose errors go to `diagnostics`. Paths are relative to the file.
/// What is wrong is reported and left at its default, so that one reading finds all mistakes of a
/// file; who reads asks the diagnostics whether there were any.
class BenchmarkReader {
 public:
  BenchmarkReader(const source::SourceSet& sources, int file, std::string folder,
                  source::Diagnostics* diagnostics)
      : sources_(sources),
        top_{file, 0, 1},
        folder_(std::move(folder)),
        diagnostics_(*diagnostics) {}

  /// The task of a file that is called `name`. It knows all figures in `met`, and in `until` those
  /// that are known while it runs.
  std::optional<BenchmarkTask> Task(const std::string& name, const TomlValue::Table& table) {
    BenchmarkTask task;
    task.name = name;
    for (const TomlEntry& entry : table) {
      const std::string& key = entry.key;
      if (key == "title") {
        Text(entry.value, &task.title);
      } else if (key == "seconds") {
        Number(entry.value, 0, kMostSeconds, &task.seconds);
      } else if (key == "world") {
        World(entry.value, &task.world);
      } else if (key == "friction") {
        if (entry.value.number() == 0.0) {
          task.friction = 0;
        } else {
          Number(entry.value, 0, 10, &task.friction);
        }
      } else if (key == "until") {
        task.until = Expression(entry.value, false);
      } else if (key == "met") {
        task.met = Expression(entry.value, true);
      } else if (key == "push") {
        task.push = Push(entry.value);
      } else {
        Unknown(entry, {"title", "seconds", "world", "friction", "until", "met", "push"});
      }
    }
    if (!HasAll(table, {"title"})) Wrong(top_, "a task has a title");
    if (!HasAll(table, {"seconds"})) Wrong(top_, "a task says how many seconds it may take");
    if (!HasAll(table, {"met"})) {
      Wrong(top_, "a task says when it is met", "add met = \"distance >= 10 m\"");
    }
    if (task.push && task.seconds > 0 &&
        task.push->after_s + task.push->seconds + task.push->settle_s >= task.seconds) {
      Wrong(top_, "the task is over before the robot has settled from its push");
    }
    return task;
  }

  /// The robots of robots.toml, a [[robot]] each.
  std::vector<BenchmarkRobot> Robots(const TomlValue::Table& table) {
    std::vector<BenchmarkRobot> robots;
    for (const TomlEntry& entry : table) {
      const TomlValue::Array* rows = entry.value.array();
      if (entry.key != "robot" || rows == nullptr) {
        Wrong(entry.key_span, "expected [[robot]]");
        continue;
      }
      for (const TomlValue& row : *rows) robots.push_back(Robot(row));
    }
    return robots;
  }

 private:
  void Wrong(const source::Span& span, std::string message, std::string hint = "") {
    diagnostics_.Error(span, std::move(message)).Hint(std::move(hint));
  }
  void Unknown(const TomlEntry& entry, const std::vector<std::string>& known) {
    Wrong(entry.key_span, fmt::format("there is no key '{}'", entry.key),
          source::NearestHint(entry.key, known, "docs/benchmark.md has those that there are"));
  }

  void Text(const TomlValue& value, std::string* out) {
    if (value.text() == nullptr || value.text()->empty()) {
      return Wrong(value.span, "expected a text");
    }
    *out = *value.text();
  }
  void Path(const TomlValue& value, std::string* out) {
    Text(value, out);
    if (!out->empty()) *out = (fs::path(folder_) / *out).lexically_normal().string();
  }
  /// The path of a world, which must be there. What stands in it is looked at when a run is
  /// planned.
  void World(const TomlValue& value, std::string* out) {
    Path(value, out);
    std::error_code error;
    if (out->empty() || fs::is_regular_file(*out, error)) return;
    Wrong(value.span, fmt::format("cannot read {}: there is no such file", *out));
  }
  /// A number above `least` and up to `most`.
  void Number(const TomlValue& value, double least, double most, double* out) {
    const std::optional<double> number = value.number();
    if (!number || !(*number > least && *number <= most)) {
      return Wrong(value.span, fmt::format("expected a number above {}, up to {}", least, most));
    }
    *out = *number;
  }
  void Texts(const TomlValue& value, std::vector<std::string>* out) {
    if (value.array() == nullptr) return Wrong(value.span, "expected a list of texts");
    for (const TomlValue& item : *value.array()) Text(item, &out->emplace_back());
  }

  /// `met`, or `until`, which cannot ask for what is known at the end only.
  std::optional<FigureExpression> Expression(const TomlValue& value, bool at_the_end) {
    std::string text;
    Text(value, &text);
    if (text.empty()) return std::nullopt;
    ExpressionError error;
    // Behind the quotation mark; escapes in the text are not counted.
    const auto at = [&value](size_t offset, size_t size) -> source::Span {
      const size_t begin = std::min(value.span.begin + 1 + offset, value.span.end);
      return {value.span.file, begin, std::min(begin + size, value.span.end)};
    };
    std::optional<FigureExpression> expression = FigureExpression::Read(text, &error);
    if (!expression) return diagnostics_.Error(at(error.offset, 1), error.message);
    for (const auto& [name, offset] : expression->names()) {
      CheckFigure(name, at(offset, name.size()), at_the_end);
    }
    if (const auto mixed = expression->FindMixedUnits(UnitOfTaskFigure)) {
      Wrong(at(mixed->offset, 1), mixed->message);
    }
    // Whether it is true or false is seen with any figures, before a run of many minutes.
    const Json one = expression->Evaluate([](const std::string&) { return Json(1.0); }, &error);
    if (!error.message.empty()) return diagnostics_.Error(at(error.offset, 1), error.message);
    if (!one.is_boolean() && !one.is_null()) {
      Wrong(value.span, "expected what is true or false", "compare it: distance >= 10 m");
    }
    return expression;
  }
  /// Says what is wrong with the name of a figure, if anything is.
  void CheckFigure(const std::string& name, const source::Span& span, bool at_the_end) {
    const auto figure = std::ranges::find(kFigures, name, &Figure::name);
    if (figure != kFigures.end() && (at_the_end || !figure->at_the_end)) return;
    if (figure != kFigures.end()) {
      return Wrong(span, fmt::format("'{}' is known once the run is over", name),
                   "'met' may ask for it, 'until' may not");
    }
    std::vector<std::string> known;
    for (const Figure& one : kFigures) {
      if (at_the_end || !one.at_the_end) known.emplace_back(one.name);
    }
    Wrong(span, fmt::format("there is no figure '{}' here", name),
          source::NearestHint(name, known, "docs/benchmark.md has those that there are"));
  }

  std::optional<BenchmarkPush> Push(const TomlValue& value) {
    BenchmarkPush push;
    if (value.table() == nullptr) {
      Wrong(value.span, "expected a table: [push]");
      return std::nullopt;
    }
    for (const TomlEntry& entry : *value.table()) {
      const std::string& key = entry.key;
      if (key == "after") {
        Number(entry.value, 0, kMostSeconds, &push.after_s);
      } else if (key == "seconds") {
        Number(entry.value, 0, 1e4, &push.seconds);
      } else if (key == "settle") {
        Number(entry.value, 0, 1e4, &push.settle_s);
      } else if (key == "weights") {
        Number(entry.value, 0, 100, &push.weights);
      } else if (key == "direction") {
        Text(entry.value, &push.direction);
        // Which body and how hard is known when it runs.
        const auto command = bridge::ParseControl("push m.l " + push.direction + " 1 1");
        if (!push.direction.empty() && !command) Wrong(entry.value.span, command.error().message);
      } else {
        Unknown(entry, {"after", "seconds", "settle", "weights", "direction"});
      }
    }
    if (!HasAll(*value.table(), {"after", "seconds", "direction", "weights", "settle"})) {
      Wrong(value.span, "a push has after, seconds, direction, weights and settle");
    }
    return push;
  }

  BenchmarkRobot Robot(const TomlValue& value) {
    BenchmarkRobot robot;
    if (value.table() == nullptr) {
      Wrong(value.span, "expected a table: [[robot]]");
      return robot;
    }
    robot.settings_from = fmt::format("{}:{}: ", sources_.name(top_.file),
                                      sources_.LineOf(top_.file, value.span.begin));
    for (const TomlEntry& entry : *value.table()) {
      const std::string& key = entry.key;
      if (key == "model") {
        Path(entry.value, &robot.model);
      } else if (key == "robot") {
        Text(entry.value, &robot.robot);
      } else if (key == "program") {
        Path(entry.value, &robot.program);
      } else if (key == "compiled_for") {
        Path(entry.value, &robot.compiled_for);
      } else if (key == "params") {
        Path(entry.value, &robot.params);
      } else if (key == "set") {
        Texts(entry.value, &robot.set);
      } else if (key == "tasks") {
        Texts(entry.value, &robot.tasks);
      } else if (key == "meets") {
        Texts(entry.value, &robot.meets);
      } else {
        Unknown(entry,
                {"model", "robot", "program", "compiled_for", "params", "set", "tasks", "meets"});
      }
    }
    if (!HasAll(*value.table(), {"model", "robot", "program"})) {
      Wrong(value.span, "a robot has model, robot and program");
    }
    return robot;
  }

  const source::SourceSet& sources_;
  source::Span top_;
  std::string folder_;
  source::Diagnostics& diagnostics_;
};

/// Reads one file into `benchmark`. False after printing what is wrong with it.
bool ReadInto(const fs::path& path, Benchmark* benchmark) {
  const Result<std::string> text = ReadFile(path.string(), 1 << 20);
  if (!text) {
    Unusable(text.error().message);
    return false;
  }
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText(path.string(), *text);
  source::CheckUtf8(sources, file, &diagnostics);
  std::optional<TomlValue::Table> table;
  if (!diagnostics.had_errors()) table = source::ParseToml(sources, file, &diagnostics);
  if (table) {
    BenchmarkReader reader(sources, file, benchmark->folder, &diagnostics);
    if (path.filename() == kRobots) {
      benchmark->robots = reader.Robots(*table);
    } else if (std::optional<BenchmarkTask> task = reader.Task(path.stem().string(), *table)) {
      benchmark->tasks.push_back(std::move(*task));
    }
  }
  PrintDiagnostics(diagnostics, sources);
  return !diagnostics.had_errors();
}

/// Whether all tasks that a robot names are there, and it is looked at at those that it is meant to
/// meet. Without this a misspelt task would be left out in silence. False after saying which is
/// not.
bool KnowsItsTasks(const Benchmark& benchmark, const BenchmarkRobot& robot) {
  const auto refuse = [&](const std::string& what) {
    Unusable(fmt::format("{}/{}: robot {} {}", benchmark.folder, kRobots, robot.robot, what));
    return false;
  };
  for (const std::vector<std::string>* names : {&robot.tasks, &robot.meets}) {
    for (const std::string& name : *names) {
      if (std::ranges::find(benchmark.tasks, name, &BenchmarkTask::name) == benchmark.tasks.end()) {
        return refuse(fmt::format("has a task '{}', which no file is called by", name));
      }
    }
  }
  for (const std::string& name : robot.meets) {
    if (!robot.tasks.empty() && std::ranges::find(robot.tasks, name) == robot.tasks.end()) {
      return refuse(fmt::format("meets '{}', which is not one of its tasks", name));
    }
  }
  return true;
}

}  // namespace

std::optional<Benchmark> ReadBenchmark(const std::string& folder) {
  Benchmark benchmark;
  benchmark.folder = folder;
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  if (error) return Refuse(fmt::format("{}: {}", folder, error.message()));
  std::sort(files.begin(), files.end());
  for (const fs::path& path : files) {
    if (!ReadInto(path, &benchmark)) return std::nullopt;
  }
  if (benchmark.tasks.empty()) return Refuse(folder + ": no task is in it (docs/benchmark.md)");
  for (const BenchmarkRobot& robot : benchmark.robots) {
    if (!KnowsItsTasks(benchmark, robot)) return std::nullopt;
  }
  return benchmark;
}

}  // namespace morphbus::tools
