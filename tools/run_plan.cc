#include "tools/run_plan.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>

#include "bridge/channels.h"
#include "compiler/dynarole/compile.h"
#include "compiler/emit/keywords.h"
#include "compiler/emit/kinematics.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"
#include "sim/simulated_assembly.h"
#include "tools/program.h"
#include "tools/run_registry.h"
#include "tools/seed_option.h"

namespace morphbus::tools {
namespace {

constexpr uint32_t kTickUs = 20000;
constexpr uint32_t kPhysicsStepUs = 1000;
constexpr uint32_t kSolverIterations = 30;

/// Where a module's channel names would not fit, or would be those of something else.
bool CheckModuleNames(const model::Robot& robot) {
  for (const model::ModuleInstance& module : robot.modules) {
    if (Result<void> good = bridge::CheckModuleName(module.name); !good) {
      Unusable(good.error().message);
      return false;
    }
  }
  return true;
}

bool CheckNumbers(const RunOptions& options) {
  const auto demand = [](bool holds, const char* what) {
    if (!holds) Unusable(what);
    return holds;
  };
  return demand(std::isfinite(options.seconds) && options.seconds >= 0 && options.seconds <= 1e6,
                "--seconds: expected 0 (until stopped) to 1000000") &&
         demand(options.loss >= 0 && options.loss <= 0.9,
                "--loss: expected a fraction, 0 to 0.9") &&
         demand(std::isfinite(options.speed) && options.speed >= 0,
                "--speed: expected times real time, or 0 for as fast as possible") &&
         demand(options.friction >= 0 && options.friction <= 100,
                "--friction: expected 0 to 100") &&
         demand(!(options.realtime && options.inproc),
                "--realtime and --inproc exclude each other: an in-process run keeps no clock");
}

/// Everything of the description that the options and the compiled parts say.
void Describe(const RunOptions& options, const model::Model& model, const model::Robot& robot,
              const std::string& image, proto::RunDescription* d) {
  const std::string bytes = model::SerializeModel(model);
  d->set_model(bytes);
  d->set_model_file(options.model_file);
  d->set_model_hash(model::ModelHash(bytes));
  d->set_robot(robot.name);
  d->set_program_image(image);
  d->set_program_file(options.program_file);
  d->set_root_module(options.root.empty()
                         ? robot.modules[static_cast<size_t>(robot.root_module)].name
                         : options.root);
  d->set_seconds(options.seconds);
  d->set_tick_us(kTickUs);
  d->set_physics_step_us(kPhysicsStepUs);
  d->set_solver_iterations(kSolverIterations);
  d->set_friction(options.friction);
  d->set_ground(options.ground);
  d->set_seed(options.seed);
  d->set_loss(options.loss);
  d->set_mode(options.realtime ? "realtime" : "lockstep");
  d->set_speed(options.realtime && options.speed == 0 ? 1.0 : options.speed);
  d->set_build("morphbus " MORPHBUS_VERSION);
  d->set_started(WallTime());
}

/// Adds the kinematics image of every module type that the robot uses.
bool AddKinematics(const model::Model& model, const model::Robot& robot, proto::RunDescription* d) {
  std::vector<int> types;
  for (const model::ModuleInstance& module : robot.modules) types.push_back(module.type);
  std::sort(types.begin(), types.end());
  types.erase(std::unique(types.begin(), types.end()), types.end());
  for (const int type : types) {
    const Result<std::string> image = emit::KinematicsImage(model, type, d->model_hash());
    if (!image) {
      Unusable(image.error().message);
      return false;
    }
    proto::KinematicsImage* entry = d->add_kinematics();
    entry->set_type_name(model.module_types[static_cast<size_t>(type)].name);
    entry->set_image(*image);
  }
  return true;
}

}  // namespace

void AddPlanOptions(CLI::App* sub, RunOptions* options) {
  sub->add_option("--robot", options->robot, "The robot's name (default: the only one)");
  sub->add_option("--seconds", options->seconds, "Sim time to run (default, and 0: until stopped)");
  sub->add_option("--loss", options->loss,
                  "Fraction of datagrams thrown away at every receiver, up to 0.9");
  AddSeed(sub, &options->seed, "Seed of --loss (default 1)");
  sub->add_option("--speed", options->speed, "Times real time (default: as fast as possible)");
  sub->add_option("--root", options->root,
                  "Module that broadcasts the root pose (default: the robot frame's)");
  sub->add_option("--friction", options->friction, "Coulomb friction of everything (default: 0.8)");
  sub->add_option("--ground", options->ground,
                  "Level ground at y = 0: true or false (default: true)");
  sub->add_flag("--realtime", options->realtime,
                "The clock runs with the wall; lateness is counted");
  sub->add_option("--run", options->run, "The run's name (default: a fresh one)");
  sub->add_option("-l,--lcm-url", options->lcm_url,
                  "LCM URL (default: $LCM_DEFAULT_URL, else LCM's own)");
}

const std::string& RunPlan::kinematics(const std::string& type_name) const {
  for (const proto::KinematicsImage& entry : description.kinematics()) {
    if (entry.type_name() == type_name) return entry.image();
  }
  static const std::string none;
  return none;
}

int64_t RunPlan::num_ticks() const {
  if (description.seconds() <= 0) return -1;
  return std::max<int64_t>(1, std::llround(description.seconds() * 1e6 / description.tick_us()));
}

std::optional<RunPlan> PlanRun(const RunOptions& options) {
  if (!CheckNumbers(options)) return std::nullopt;
  if (!options.run.empty()) {
    if (Result<void> good = bridge::CheckRunName(options.run); !good) {
      Unusable("--run: " + good.error().message);
      return std::nullopt;
    }
  }
  std::optional<model::Model> model = LoadModel({options.model_file});
  if (!model) return std::nullopt;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr || !CheckModuleNames(*robot)) return std::nullopt;
  if (!options.root.empty() && !robot->FindModule(options.root)) {
    Unusable(fmt::format("--root: robot {} has no module '{}'", robot->name, options.root));
    return std::nullopt;
  }
  const std::optional<CompiledProgram> program = CompileProgram(options.program_file, *model);
  if (!program) return std::nullopt;
  RunPlan plan;
  Describe(options, *model, *robot, program->image, &plan.description);
  plan.description.set_program_hash(program->hash);
  plan.description.set_run(options.run);
  if (!AddKinematics(*model, *robot, &plan.description)) return std::nullopt;
  plan.robot_index = static_cast<int>(robot - model->robots.data());
  plan.model = std::move(*model);
  const auto assembly = BuildAssembly(plan);
  if (!assembly) {
    Unusable(assembly.error().message);
    return std::nullopt;
  }
  plan.description.set_world_hash((*assembly)->world_hash());
  return plan;
}

Result<RunPlan> PlanFromDescription(const std::string& bytes) {
  RunPlan plan;
  if (!plan.description.ParseFromString(bytes)) return Fail("this is no description of a run");
  Result<model::Model> model = model::ParseModel(plan.description.model());
  if (!model) return Fail("the description's model cannot be used: " + model.error().message);
  plan.model = std::move(*model);
  const model::Robot* robot = plan.model.FindRobot(plan.description.robot());
  if (robot == nullptr)
    return Fail("the description's model has no robot " + plan.description.robot());
  plan.robot_index = static_cast<int>(robot - plan.model.robots.data());
  return plan;
}

void AddPlanSource(CLI::App* sub, PlanSource* source) {
  sub->add_option("FILE", source->options.model_file, "M3L file");
  sub->add_option("PROGRAM", source->options.program_file, "DynaRole program or image");
  sub->add_option("--description", source->description,
                  "The run's description, instead of the files");
  AddPlanOptions(sub, &source->options);
}

std::optional<RunPlan> LoadPlan(const PlanSource& source) {
  if (source.description.empty()) {
    if (source.options.model_file.empty() || source.options.program_file.empty() ||
        source.options.run.empty()) {
      Unusable("expected FILE.m3l PROGRAM.dyn --run NAME, or --description FILE");
      return std::nullopt;
    }
    return PlanRun(source.options);
  }
  const Result<std::string> bytes = ReadFile(source.description);
  Result<RunPlan> plan = bytes ? PlanFromDescription(*bytes) : Fail(bytes.error().message);
  if (!plan) {
    Unusable(source.description + ": " + plan.error().message);
    return std::nullopt;
  }
  return std::move(*plan);
}

RootPose RootPoseOf(const RunPlan& plan, int module) {
  const model::Robot& robot = plan.robot();
  RootPose root;
  root.link = module == robot.root_module ? robot.root_link : 0;
  const model::KinematicState state =
      model::ForwardKinematics(plan.model, robot, model::StartValues(robot));
  root.X_RL = state.X_RL[static_cast<size_t>(module)][static_cast<size_t>(root.link)];
  return root;
}

Result<std::unique_ptr<sim::SimulatedAssembly>> BuildAssembly(const RunPlan& plan) {
  sim::AssemblyOptions options;
  options.world.friction = plan.description.friction();
  options.world.ground = plan.description.ground();
  options.world.solver_iterations = static_cast<int>(plan.description.solver_iterations());
  options.tick_us = static_cast<int>(plan.description.tick_us());
  options.physics_step_us = static_cast<int>(plan.description.physics_step_us());
  return sim::SimulatedAssembly::Create(std::make_shared<const model::Model>(plan.model),
                                        plan.robot().name, options);
}

Result<bridge::SimPartyOptions> SimOptions(const RunPlan& plan, bool logger) {
  bridge::SimPartyOptions options;
  const proto::RunDescription& d = plan.description;
  options.run = d.run();
  options.model_hash = d.model_hash();
  options.program_hash = d.program_hash();
  options.logger = logger;
  options.num_ticks = plan.num_ticks();
  options.tick_us = static_cast<int32_t>(d.tick_us());
  options.realtime = d.mode() == "realtime";
  options.speed = d.speed();
  const model::Robot& robot = plan.robot();
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    bridge::ExpectedModule expected;
    expected.name = robot.modules[m].name;
    expected.id = static_cast<uint16_t>(m);
    const model::ModuleType& type = plan.model.TypeOf(robot, static_cast<int>(m));
    expected.type_name = type.name;
    expected.num_connectors = static_cast<int>(type.connectors.size());
    const Result<uint64_t> hash = KinematicsHash(plan.kinematics(expected.type_name));
    if (!hash) return Fail(hash.error().message);
    expected.kinematics_hash = *hash;
    options.modules.push_back(expected);
  }
  return options;
}

uint64_t ReceiverSeed(uint64_t run_seed, int receiver) {
  return run_seed * 1000003 + static_cast<uint64_t>(receiver + 2);
}

}  // namespace morphbus::tools
