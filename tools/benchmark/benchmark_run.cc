#include "tools/benchmark/benchmark_run.h"

#include <fmt/format.h>

#include <cmath>

#include "bridge/control/control_command.h"
#include "compiler/model/link_mass.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/benchmark/robot_track.h"
#include "tools/launch/inproc_run.h"
#include "tools/launch/launcher_link.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {
namespace {

/// The value of an expression over figures. Its names were checked when it was read; what cannot be
/// computed, as of a figure that this run does not have, does not hold.
bool Holds(const FigureExpression& expression, const Json& figures) {
  const auto lookup = [&figures](const std::string& name) {
    const auto found = figures.find(name);
    return found == figures.end() ? std::nullopt : std::optional<Json>(*found);
  };
  ExpressionError error;
  const Json value = expression.Evaluate(lookup, &error);
  return value.is_boolean() && value.get<bool>();
}

/// The push of a task as a command of the run's script. Fails if its direction is none.
Result<ScriptedCommand> PushCommand(const BenchmarkPush& push, const RunPlan& plan,
                                    const RobotTrack& track) {
  const model::LinkRef link = track.trunk().link;
  const std::string& module = plan.robot().modules[link.module].name;
  const std::string& name = plan.model.TypeOf(plan.robot(), link.module).links[link.link].name;
  const double force_n = push.weights * track.mass_kg() * model::kGravity;
  Result<bridge::ControlCommand> command = bridge::ParseControl(
      fmt::format("push {}.{} {} {} {}", module, name, push.direction, force_n, push.seconds));
  if (!command) return Fail(command.error().message);
  return ScriptedCommand{std::llround(push.after_s * 1e6 / plan.description.tick_us()),
                         *std::move(command)};
}

/// Adds what is known of a push once the run is over: how fast and how high the robot was as long
/// before it as after it had settled.
void AddPushFigures(const BenchmarkTask& task, const RobotTrack& track, Json* figures) {
  const char* names[] = {"speed_before", "speed_after", "height_before", "height_after"};
  for (const char* name : names) (*figures)[name] = nullptr;
  if (!task.push) return;
  const double end_s = (*figures)["seconds"].get<double>();
  const double begin_s = task.push->after_s + task.push->seconds + task.push->settle_s;
  // A run that ends before it has settled has nothing to tell of after.
  if (end_s <= begin_s) return;
  const double before_s = std::max(0.0, task.push->after_s - (end_s - begin_s));
  (*figures)["speed_before"] = track.SpeedBetween(before_s, task.push->after_s);
  (*figures)["speed_after"] = track.SpeedBetween(begin_s, end_s);
  (*figures)["height_before"] = track.HeightBetween(before_s, task.push->after_s);
  (*figures)["height_after"] = track.HeightBetween(begin_s, end_s);
}

}  // namespace

std::optional<RunPlan> PlanBenchmark(const BenchmarkTask& task, const BenchmarkRobot& robot) {
  RunOptions options;
  options.model_file = robot.model;
  options.program_file = robot.program;
  options.robot = robot.robot;
  options.params = robot.params;
  options.set = robot.set;
  options.settings_from = robot.settings_from;
  options.seconds = task.seconds;
  options.world = task.world;
  options.friction = task.friction;
  options.run = "benchmark";
  if (robot.compiled_for.empty()) return PlanRun(options);
  // The program names parts of module types that the robot's own model does not have.
  std::optional<model::Model> model = LoadModel({robot.model});
  const std::optional<model::Model> words = LoadModel({robot.compiled_for});
  if (!model || !words) return std::nullopt;
  const std::optional<CompiledProgram> program =
      LoadProgram(robot.program, keywords::KeywordsOf(*words));
  if (!program || !CheckNumbers(options)) return std::nullopt;
  return PlanCompiled(options, *std::move(model), *program);
}

BenchmarkOutcome RunBenchmark(const BenchmarkTask& task, RunPlan plan) {
  BenchmarkOutcome outcome;
  const auto failed = [&outcome](std::string why) {
    outcome.error = std::move(why);
    return outcome;
  };
  RobotTrack track(plan.model, plan.robot(), plan.description.noise_seed());
  if (task.push) {
    Result<ScriptedCommand> push = PushCommand(*task.push, plan, track);
    if (!push) return failed(push.error().message);
    InsertInOrder(*std::move(push), &plan.script);
  }
  const Result<RunRecord> record = RunRecord::InMemory();
  const Result<bridge::RunKey> key = bridge::RunKey::Random();
  if (!record || !key) return failed((record ? key.error() : record.error()).message);
  plan.description.set_started(WallTime());
  InprocRun run(plan, *record, *key);
  if (Result<void> built = run.Build(); !built) return failed(built.error().message);
  // Tick by tick; the task's own end is looked for every second, so that its last tick is one that
  // people can name.
  const int64_t tick_us = plan.description.tick_us();
  const int64_t second = std::max<int64_t>(1, 1'000'000 / tick_us);
  bool reached = false;
  for (int64_t tick = 0; !reached && run.GoOnTo(tick); ++tick) {
    if (CaughtSignal() != 0) return failed("it was interrupted");
    track.Take(run.robot(), tick * tick_us);
    reached =
        task.until && tick > 0 && tick % second == 0 && Holds(*task.until, track.FiguresSoFar());
  }
  if (reached) {
    run.desk().Give(1, *bridge::ParseControl("stop"));
    run.GoOnTo(bridge::kNever);
  }
  const RunSummary summary = Summarize(plan, run.Finish());
  if (!summary.outcome.error.empty()) return failed(summary.outcome.error);
  // What the log tells stands beside what was seen on the way.
  const logger::RunFigures& told = summary.figures;
  outcome.figures = track.FiguresOfAll();
  outcome.figures["energy"] = told.energy_j;
  outcome.figures["cost_of_transport"] =
      told.transport.cost ? Json(*told.transport.cost) : Json(nullptr);
  outcome.figures["max_tilt"] = told.max_tilt_rad;
  outcome.figures["num_faults"] = SummaryJson(summary)["num_faults"];
  AddPushFigures(task, track, &outcome.figures);
  outcome.hash = summary.hash;
  outcome.met = Holds(*task.met, outcome.figures);
  return outcome;
}

}  // namespace morphbus::tools
