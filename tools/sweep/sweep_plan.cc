#include "tools/sweep/sweep_plan.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <tuple>
#include <utility>

#include "bridge/wire/stream_hash.h"
#include "compiler/base/text.h"
#include "compiler/m3l/compile.h"
#include "compiler/model/model_proto.h"
#include "tools/base/variants_text.h"
#include "tools/base/work_progress.h"
#include "tools/sweep/sampling.h"

namespace morphbus::tools {

/// A model, with the variants that run of one of its robots.
struct SweepModel {
  model::Model model;
  /// Their names; that of the robot itself is the first one.
  std::vector<std::string> robots;
};

namespace {

/// Adds `count` variants of a robot to a model, as the file of `morphbus variants` that imports it
/// would. Nothing, after saying why, if there are not so many.
std::optional<SweepModel> WithVariants(const std::string& path, const model::Model& model,
                                       const std::string& robot_name, int count) {
  const model::Robot* robot = PickRobot(model, robot_name);
  if (robot == nullptr) return std::nullopt;
  congruence::VariantOptions wanted;
  wanted.max = static_cast<size_t>(count);
  const std::vector<congruence::Variant> variants = congruence::Variants(model, *robot, wanted);
  if (static_cast<int>(variants.size()) < count) {
    return Refuse(fmt::format("variants = {}: {} of {} are found", count,
                              Counted(static_cast<int64_t>(variants.size()), "variant"),
                              robot->name));
  }
  // The text stands for a file beside the model, which nobody needs to write.
  const std::filesystem::path file(path);
  const std::string text = VariantsText(model, *robot, variants, file.filename().string());
  m3l::CompileOutput output =
      m3l::CompileText((file.parent_path() / (robot->name + "_variants.m3l")).string(), text);
  PrintDiagnostics(output.diagnostics, output.sources);
  if (!output.model) return std::nullopt;
  SweepModel made = {std::move(*output.model), {robot->name}};
  for (const congruence::Variant& variant : variants) made.robots.push_back(variant.robot.name);
  return made;
}

/// The key of the run that a description plans: equal for runs that cannot but go alike. The image
/// of a program holds its file's name, so that the same program under another name has another key.
std::string KeyOf(const proto::RunDescription& description) {
  proto::RunDescription inputs = description;
  // What people call things, when it was, and what follows from the rest or from the machine.
  inputs.clear_run();
  inputs.clear_started();
  inputs.clear_model_file();
  inputs.clear_program_file();
  inputs.clear_world_file();
  inputs.clear_faults_file();
  inputs.clear_lcm_schema();
  inputs.clear_world_hash();
  inputs.clear_build();
  inputs.clear_arithmetic();
  // The model has what was set of it; how its links look changes no run.
  inputs.set_model(model::WithoutLooks(inputs.model()));
  inputs.clear_attributes();
  // The message has no maps, so that equal ones have equal bytes.
  return bridge::BytesHash(inputs.SerializeAsString());
}

}  // namespace

/// What was compiled for one row serves the next.
class SweepPlanner::Compiled {
 public:
  explicit Compiled(const SweepFile& sweep) : sweep_(sweep) {}

  bool Add(const RunPoint& point) {
    RunOptions options = OptionsOf(point, sweep_.folder);
    const SweepModel* model = ModelOf(options);
    if (model == nullptr) return false;
    PlannedRow row;
    row.point = point;
    if (sweep_.variants > 0) {
      // The model may have but one robot, whose name nobody needed to say.
      row.point["robot"] = model->robots.front();
      options.robot = model->robots[point.value(kVariant, 0)];
      row.point[kVariant] = options.robot;
    }
    const CompiledProgram* program = ProgramOf(options, *model);
    if (program == nullptr || !CheckNumbers(options)) return false;
    std::optional<RunPlan> plan = PlanCompiled(options, model->model, *program);
    if (!plan) return false;
    row.key = KeyOf(plan->description);
    row.inputs = Split(std::move(plan->description));
    plan_.rows.push_back(std::move(row));
    return true;
  }
  SweepPlan Take() { return std::exchange(plan_, {}); }

 private:
  /// The model of a run, null after printing what is wrong with it.
  const SweepModel* ModelOf(const RunOptions& options) {
    const std::string robot = sweep_.variants > 0 ? options.robot : "";
    const auto [found, fresh] = models_.try_emplace({options.model_file, robot});
    if (!fresh) return found->second ? &*found->second : nullptr;
    std::optional<model::Model> model = LoadModel({options.model_file});
    if (!model) return nullptr;
    found->second = sweep_.variants > 0
                        ? WithVariants(options.model_file, *model, robot, sweep_.variants)
                        : SweepModel{std::move(*model), {}};
    return found->second ? &*found->second : nullptr;
  }

  /// Its program, likewise.
  const CompiledProgram* ProgramOf(const RunOptions& options, const SweepModel& model) {
    const auto [found, fresh] = programs_.try_emplace({options.program_file, &model});
    if (fresh) found->second = LoadProgram(options.program_file, keywords::KeywordsOf(model.model));
    return found->second ? &*found->second : nullptr;
  }

  /// Takes a description apart into what many rows share and the rest.
  RowInputs Split(proto::RunDescription description) {
    proto::RunDescription robot, program, world;
    robot.set_model(std::move(*description.mutable_model()));
    robot.mutable_kinematics()->Swap(description.mutable_kinematics());
    program.set_program_image(std::move(*description.mutable_program_image()));
    world.set_world(std::move(*description.mutable_world()));
    world.mutable_world_meshes()->Swap(description.mutable_world_meshes());
    world.mutable_world_heights()->Swap(description.mutable_world_heights());
    world.set_faults(std::move(*description.mutable_faults()));
    description.clear_model();
    description.clear_program_image();
    description.clear_world();
    description.clear_faults();
    RowInputs inputs;
    for (const proto::RunDescription* part : {&robot, &program, &world}) {
      const std::string bytes = part->SerializeAsString();
      if (bytes.empty()) continue;
      inputs.parts.push_back(bridge::BytesHash(bytes));
      plan_.parts.try_emplace(inputs.parts.back(), bytes);
    }
    // When it was planned is nobody's business, so that equal sweeps have equal bytes.
    description.clear_started();
    inputs.own = description.SerializeAsString();
    return inputs;
  }

  const SweepFile& sweep_;
  SweepPlan plan_;
  /// By path, and by robot where variants of it run.
  std::map<std::pair<std::string, std::string>, std::optional<SweepModel>> models_;
  std::map<std::pair<std::string, const SweepModel*>, std::optional<CompiledProgram>> programs_;
};

SweepPlanner::SweepPlanner(const SweepFile& sweep) : compiled_(std::make_unique<Compiled>(sweep)) {}
SweepPlanner::~SweepPlanner() = default;
bool SweepPlanner::Add(const RunPoint& point) { return compiled_->Add(point); }
SweepPlan SweepPlanner::Take() { return compiled_->Take(); }

std::optional<SweepPlan> PlanSweep(const SweepFile& sweep) {
  const Result<std::vector<RunPoint>> points = PointsOf(sweep);
  if (!points) return Refuse(points.error().message);
  SweepPlanner planner(sweep);
  WorkProgress progress;
  size_t row = 0;
  for (const RunPoint& point : *points) {
    ++row;
    if (!planner.Add(point)) {
      return Refuse(
          fmt::format("row {} of {} cannot run: {}", row, points->size(), PointText(point)));
    }
    progress.Show("planned", static_cast<double>(row) / static_cast<double>(points->size()));
  }
  return planner.Take();
}

}  // namespace morphbus::tools
