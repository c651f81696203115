// morphbus benchmark: how robots and their programs do at tasks.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <future>
#include <thread>

#include "compiler/base/text.h"
#include "tools/base/messages.h"
#include "tools/base/print.h"
#include "tools/benchmark/benchmark_results.h"
#include "tools/commands/commands.h"
#include "tools/launch/launcher_link.h"
#include "tools/plan/settings.h"
#include "tools/sweep/local_engine.h"

namespace morphbus::tools {
namespace {

/// The options of `morphbus benchmark`.
struct BenchmarkOptions {
  std::string folder, model, program, robot, compiled_for, params;
  std::vector<std::string> set, tasks;
  int jobs = 0;
  bool dry_run = false;
  bool write = false;
  bool json = false;
};

/// A row of the table, whose outcome is still to come, with the run that brings it.
struct PlannedTask {
  BenchmarkRow row;
  RunPlan plan;
};

/// Whether `name` is one of `names`; no names stand for all that there are.
bool Asked(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::ranges::find(names, name) != names.end();
}

/// The robots to be looked at: that of the command line, which is meant to meet every task, or
/// those of the folder, of them those that --robot names. None after saying that there is none of
/// that name.
std::vector<BenchmarkRobot> RobotsOf(const BenchmarkOptions& options, const Benchmark& benchmark) {
  if (!options.model.empty()) {
    BenchmarkRobot own;
    own.model = options.model;
    own.robot = options.robot;
    own.program = options.program;
    own.compiled_for = options.compiled_for;
    own.params = options.params;
    own.set = options.set;
    for (const BenchmarkTask& task : benchmark.tasks) own.meets.push_back(task.name);
    return {own};
  }
  std::vector<BenchmarkRobot> robots = benchmark.robots;
  if (options.robot.empty()) return robots;
  std::vector<std::string> names;
  for (const BenchmarkRobot& one : robots) {
    if (std::ranges::find(names, one.robot) == names.end()) names.push_back(one.robot);
  }
  std::erase_if(robots, [&](const BenchmarkRobot& one) { return one.robot != options.robot; });
  if (robots.empty()) {
    Unusable(fmt::format("--robot: no robot of this folder is called '{}'{}; there are {}",
                         options.robot, DidYouMean(options.robot, names), fmt::join(names, ", ")));
  }
  return robots;
}

/// Whether all tasks of --task are there; says which one is not.
bool KnowsTasks(const BenchmarkOptions& options, const Benchmark& benchmark) {
  std::vector<std::string> names;
  for (const BenchmarkTask& task : benchmark.tasks) names.push_back(task.name);
  for (const std::string& name : options.tasks) {
    if (std::ranges::find(names, name) != names.end()) continue;
    Unusable(fmt::format("--task: there is no task '{}'{}; there are {}", name,
                         DidYouMean(name, names), fmt::join(names, ", ")));
    return false;
  }
  return true;
}

/// Plans all rows; nothing after saying why one cannot run.
std::optional<std::vector<PlannedTask>> PlanAll(const BenchmarkOptions& options,
                                                const Benchmark& benchmark) {
  if (!KnowsTasks(options, benchmark)) return std::nullopt;
  if (options.model.empty() && benchmark.robots.empty()) {
    return Refuse(options.folder + ": no robot is in it: see robots.toml in docs/benchmark.md");
  }
  const std::vector<BenchmarkRobot> robots = RobotsOf(options, benchmark);
  if (robots.empty()) return std::nullopt;
  std::vector<PlannedTask> planned;
  for (const BenchmarkTask& task : benchmark.tasks) {
    if (!Asked(options.tasks, task.name)) continue;
    for (const BenchmarkRobot& robot : robots) {
      if (!Asked(robot.tasks, task.name)) continue;
      std::optional<RunPlan> plan = PlanBenchmark(task, robot);
      if (!plan) return std::nullopt;
      BenchmarkRow row = RowOf(task, robot);
      // Where the model has but one robot, nobody needs to name it.
      row.robot = plan->robot().name;
      row.model_hash = Hex(plan->description.model_hash());
      row.program_hash = Hex(plan->description.program_hash());
      row.world_hash = plan->description.world_hash();
      planned.push_back({std::move(row), *std::move(plan)});
    }
  }
  if (planned.empty()) {
    return Refuse(fmt::format("robot '{}' is not looked at at that task: its tasks are {}",
                              robots.front().robot, fmt::join(robots.front().tasks, ", ")));
  }
  return planned;
}

/// The rows alone.
std::vector<BenchmarkRow> RowsOf(std::vector<PlannedTask> planned) {
  std::vector<BenchmarkRow> rows;
  for (PlannedTask& one : planned) rows.push_back(std::move(one.row));
  return rows;
}

/// Runs all rows, so many at a time, and shows each as soon as it and those before it are done.
/// Each is a run by itself, so that nothing depends on how many run at a time. After Ctrl-C the
/// rows that have not begun fail, so that what is done already is still shown.
void RunAll(std::vector<PlannedTask>* planned, int jobs,
            const std::function<void(const BenchmarkRow&)>& show) {
  std::vector<std::promise<BenchmarkOutcome>> promises(planned->size());
  std::atomic<size_t> next = 0;
  const auto work = [&] {
    for (size_t i = next++; i < planned->size(); i = next++) {
      PlannedTask& one = (*planned)[i];
      BenchmarkOutcome outcome;
      outcome.error = "it was interrupted";
      if (CaughtSignal() == 0) outcome = RunBenchmark(*one.row.task, std::move(one.plan));
      promises[i].set_value(std::move(outcome));
    }
  };
  // The threads end with the function, after their last rows; what they run comes here in order.
  std::vector<std::jthread> threads;
  for (int i = 0; i < std::min(jobs, static_cast<int>(planned->size())); ++i) {
    threads.emplace_back(work);
  }
  for (size_t i = 0; i < planned->size(); ++i) {
    (*planned)[i].row.outcome = promises[i].get_future().get();
    show((*planned)[i].row);
  }
}

/// Prints rows as they come, by task. Behind the rows of a robot of one's own stand those that
/// results.json has of the same task: `known`.
class TablePrinter {
 public:
  explicit TablePrinter(std::vector<Json> known) : known_(std::move(known)) {}

  void Show(const BenchmarkRow& row) {
    if (row.task != task_) {
      Finish();
      PrintText((task_ == nullptr ? "" : "\n") + TaskHeading(*row.task));
      task_ = row.task;
    }
    PrintText(RowText(RowJson(row)));
    FlushResult();
  }
  void Finish() const {
    for (const Json& row : known_) {
      if (task_ != nullptr && row["task"] == task_->name) PrintText(RowText(row));
    }
  }

 private:
  std::vector<Json> known_;
  const BenchmarkTask* task_ = nullptr;
};

/// Says which robots do not meet a task that they are meant to meet. How many rows those are.
int CountUnmet(const std::vector<BenchmarkRow>& rows) {
  int unmet = 0;
  for (const BenchmarkRow& row : rows) {
    if (!row.meant || row.outcome.met || !row.outcome.error.empty()) continue;
    ++unmet;
    Warn(fmt::format("{}: {} does not meet {}, as robots.toml says that it does", row.model,
                     row.robot, row.task->name));
  }
  return unmet;
}

/// How a row differs from that of results.json: in what has come of the run, unless `ran` is false,
/// and in what it is made of. Empty if it does not.
std::string Difference(const BenchmarkRow& row, const Json& known, bool ran) {
  std::string text;
  if (ran && known != RowJson(row)) {
    text = fmt::format("{} and hash {}, in results.json {} and hash {}",
                       row.outcome.met ? "met" : "not met", row.outcome.hash,
                       known["met"].get<bool>() ? "met" : "not met", JsonText(known["hash"]));
  }
  if (const std::vector<std::string> others = OtherInputs(row, known); !others.empty()) {
    text += fmt::format("{}the {} of results.json {}", text.empty() ? "" : "; ",
                        fmt::join(others, ", "), others.size() == 1 ? "is another" : "are others");
  }
  return text;
}

/// Says which rows are not as results.json has them, and which it does not have. How many there
/// are.
int CountDifferences(const std::vector<BenchmarkRow>& rows, const std::vector<Json>& results,
                     bool ran) {
  int different = 0;
  for (const BenchmarkRow& row : rows) {
    const Json* known = FindResult(results, row);
    const std::string difference = known != nullptr ? Difference(row, *known, ran)
                                                    : "it is not in results.json; --write adds it";
    if (difference.empty()) continue;
    ++different;
    Warn(fmt::format("{} of {}, {}: {}", row.task->name, row.robot, row.program, difference));
  }
  return different;
}

/// --dry-run: how many runs it would be, and which of them are made of something else than those of
/// `results` were, or are not there. Of a robot of one's own, which is in no results, only how
/// many.
int DryRun(const std::vector<BenchmarkRow>& rows, const std::vector<Json>& results, bool own,
           bool json) {
  const int different = own ? 0 : CountDifferences(rows, results, false);
  if (json) {
    Json list = Json::array();
    for (const BenchmarkRow& row : rows) {
      Json one = RowJson(row);
      for (const char* of_the_run : {"met", "hash", "figures", "error"}) one.erase(of_the_run);
      const Json* known = own ? nullptr : FindResult(results, row);
      one["others"] = known == nullptr ? Json(nullptr) : Json(OtherInputs(row, *known));
      list.push_back(std::move(one));
    }
    PrintJson({{"rows", list}});
  } else {
    std::string text = Counted(static_cast<int64_t>(rows.size()), "run");
    if (!own) {
      const int64_t missing = std::ranges::count_if(
          rows, [&](const BenchmarkRow& row) { return FindResult(results, row) == nullptr; });
      const int64_t others = different - missing;
      text += fmt::format(", {} of another model, program or world than in results.json",
                          others == 0 ? "none" : std::to_string(others));
      if (missing > 0) text += fmt::format(", {} not in it", missing);
    }
    PrintText(text + "\n");
  }
  return different == 0 ? kDone : kNo;
}

int RunBenchmarks(const BenchmarkOptions& options) {
  if (options.model.empty() != options.program.empty()) {
    return Unusable("expected a model and a program, or neither");
  }
  // A robot of one's own comes from the command line, all others with their settings from the
  // folder.
  const bool own = !options.model.empty();
  if (!own && !(options.params.empty() && options.set.empty() && options.compiled_for.empty())) {
    return Unusable("--params, --set and --compiled-for are for a model and program of your own");
  }
  if (own && options.write) {
    return Unusable("--write is for the robots of robots.toml: add your own there");
  }
  if (options.dry_run && options.write) {
    return Unusable("--dry-run runs nothing that --write could write");
  }
  const std::optional<Benchmark> benchmark = ReadBenchmark(options.folder);
  if (!benchmark) return kUnusable;
  const Result<std::vector<Json>> results = ReadResults(options.folder);
  if (!results) return Unusable(results.error().message);
  // Whatever cannot run is known before the first of many minutes.
  std::optional<std::vector<PlannedTask>> planned = PlanAll(options, *benchmark);
  if (!planned) return kUnusable;
  if (options.dry_run) {
    return DryRun(RowsOf(*std::move(planned)), *results, own, options.json);
  }
  CatchSignals();
  TablePrinter table(own ? *results : std::vector<Json>());
  RunAll(&*planned, options.jobs > 0 ? options.jobs : ProcessorCount(),
         [&](const BenchmarkRow& row) {
           if (!options.json) table.Show(row);
         });
  if (!options.json) table.Finish();
  const std::vector<BenchmarkRow> rows = RowsOf(*std::move(planned));
  if (options.json) {
    Json list = Json::array();
    for (const BenchmarkRow& row : rows) list.push_back(RowJson(row));
    PrintJson({{"rows", list}});
  }
  const bool failed =
      std::ranges::any_of(rows, [](const BenchmarkRow& row) { return !row.outcome.error.empty(); });
  if (failed) return kFailed;
  if (options.write) {
    if (Result<void> written = WriteResults(*benchmark, rows); !written) {
      return Unusable(written.error().message);
    }
  }
  if (own) {
    const auto met = [](const BenchmarkRow& row) { return row.outcome.met; };
    return std::ranges::all_of(rows, met) ? kDone : kNo;
  }
  // What has just been written is no difference, but a task that is not met stays one.
  const int differences = options.write ? 0 : CountDifferences(rows, *results, true);
  return CountUnmet(rows) + differences > 0 ? kNo : kDone;
}

}  // namespace

void AddBenchmark(CommandLine* line) {
  Subcommand sub = line->Add("benchmark", "How robots and their programs do at tasks");
  auto options = std::make_shared<BenchmarkOptions>();
  sub.Add("FOLDER", &options->folder, "Folder of tasks, such as models/benchmark").Required();
  sub.Add("FILE.m3l", &options->model, "Model of a robot of your own");
  sub.Add("PROG.dyn", &options->program, "Its program, as text or as an image");
  sub.Robot(&options->robot);
  sub.Add("--task", &options->tasks, "Only this task, by the name of its file; may be repeated")
      .TypeName("TASK")
      .Repeatable();
  sub.Add("--compiled-for", &options->compiled_for,
          "Model that has all words of the program (default: the robot's own)")
      .TypeName("FILE.m3l");
  AddSettings(&sub, &options->params, &options->set);
  sub.Add("--jobs", &options->jobs, "Runs at a time (default: as many as there are processors)")
      .Range(1, 1024);
  sub.Flag("--dry-run", &options->dry_run,
           "Run nothing: only say whether results.json is of the same models, programs and worlds");
  sub.Flag("--write", &options->write, "Write what the robots get into FOLDER/results.json");
  sub.Json(&options->json);
  sub.Footer(
      "(yes) and (no): the robot is looked at, but not meant to meet the task.\n"
      "Exit status 1: a robot of FOLDER gets another result than results.json has, or has none "
      "there, or does not meet a task that it is meant to, or one of your own does not meet a "
      "task.\n"
      "Examples:\n  morphbus benchmark models/benchmark\n"
      "  morphbus benchmark models/benchmark --task straight --robot car\n"
      "  morphbus benchmark models/benchmark models/mtran.m3l walk.dyn --robot quadruped");
  sub.Do([options] { return RunBenchmarks(*options); });
}

}  // namespace morphbus::tools
