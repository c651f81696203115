#include "tools/launch/run_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bridge/wire/channels.h"
#include "compiler/dynarole/compile.h"
#include "compiler/emit/kinematics.h"
#include "compiler/keywords/module_keywords.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"
#include "sim/bullet_robot.h"
#include "sim/still_robot.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/base/model_io.h"
#include "tools/base/program.h"
#include "tools/launch/run_registry.h"

namespace morphbus::tools {
namespace {

/// Control period, microseconds; sensors and commands are exchanged once a tick.
constexpr uint32_t kTickUs = 20000;
/// Step of the physics, microseconds, and iterations of its solver: part of the world hash.
constexpr uint32_t kPhysicsStepUs = 1000;
constexpr uint32_t kSolverIterations = 30;

/// The robot in a fresh Bullet world.
Result<std::unique_ptr<sim::BulletRobot>> BuildBulletRobot(const RunPlan& plan) {
  sim::BulletRobotOptions options;
  // All that the world hash covers comes from the description, so that every process builds the
  // same world.
  options.world.friction = plan.description.friction();
  options.world.ground = plan.description.ground();
  options.world.solver_iterations = static_cast<int>(plan.description.solver_iterations());
  options.tick_us = static_cast<int>(plan.description.tick_us());
  options.physics_step_us = static_cast<int>(plan.description.physics_step_us());
  return sim::BulletRobot::Create(std::make_shared<const model::Model>(plan.model),
                                  plan.robot().name, options);
}

/// Says which option is out of its range.
bool CheckNumbers(const RunOptions& options) {
  // The first option that is out of its range is named; a number that is none fails its comparison.
  // Prints what is expected unless the condition holds.
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
         demand(options.friction >= 0 && options.friction <= 10, "--friction: expected 0 to 10") &&
         demand(!(options.realtime && options.inproc),
                "--realtime and --inproc exclude each other: an in-process run keeps no clock");
}

/// Everything of the description that the options and the compiled parts say.
void Describe(const RunOptions& options, const model::Model& model, const model::Robot& robot,
              const std::string& image, proto::RunDescription* d) {
  // The hash is that of the bytes that stand in the description.
  const std::string bytes = model::SerializeModel(model);
  d->set_model(bytes);
  d->set_model_file(options.model_file);
  d->set_model_hash(model::ModelHash(bytes));
  // What runs: the robot, the program, and the module that knows where it is.
  d->set_robot(robot.name);
  d->set_program_image(image);
  d->set_program_file(options.program_file);
  d->set_root_module(options.root.empty() ? robot.modules[robot.root_module].name : options.root);
  // How long it runs, in which steps, and in what world.
  d->set_seconds(options.seconds);
  d->set_tick_us(kTickUs);
  d->set_physics_step_us(kPhysicsStepUs);
  d->set_solver_iterations(kSolverIterations);
  d->set_friction(options.friction);
  d->set_ground(options.ground);
  d->set_still(options.still);
  // What is thrown away on purpose.
  d->set_seed(options.seed);
  d->set_loss(options.loss);
  // In real time the pace defaults to that of the wall, in lockstep to as fast as it goes.
  d->set_mode(options.realtime ? "realtime" : "lockstep");
  d->set_speed(options.realtime && options.speed == 0 ? 1.0 : options.speed);
  d->set_build("morphbus " MORPHBUS_VERSION);
  d->set_started(WallTime());
}

/// Adds the kinematics image of every module type that the robot uses.
bool AddKinematics(const model::Model& model, const model::Robot& robot, proto::RunDescription* d) {
  // Each type once, in order of the model, so that equal runs have equal descriptions.
  std::vector<int> types;
  for (const model::ModuleInstance& module : robot.modules) types.push_back(module.type);
  std::sort(types.begin(), types.end());
  types.erase(std::unique(types.begin(), types.end()), types.end());
  for (const int type : types) {
    // A module type that the VM cannot hold, with too many joints say, is refused here.
    const Result<std::string> image = emit::KinematicsImage(model, type, d->model_hash());
    if (!image) {
      Unusable(image.error().message);
      return false;
    }
    proto::KinematicsImage* entry = d->add_kinematics();
    entry->set_type_name(model.module_types[type].name);
    entry->set_image(*image);
  }
  return true;
}

}  // namespace

void AddPlanOptions(Subcommand* sub, RunOptions* options) {
  sub->Robot(&options->robot);
  sub->Add("--seconds", &options->seconds, "Sim time to run (default, and 0: until stopped)");
  sub->Add("--loss", &options->loss,
           "Fraction of datagrams thrown away at every receiver, up to 0.9");
  sub->Seed(&options->seed, "Seed of --loss (default 1)");
  sub->Add("--speed", &options->speed, "Times real time (default: as fast as possible)");
  sub->Add("--root", &options->root,
           "Module that broadcasts the root pose (default: the robot frame's)");
  sub->Add("--friction", &options->friction, "Coulomb friction of everything (default: 0.8)");
  sub->Add("--ground", &options->ground, "Level ground at y = 0: true or false (default: true)");
  sub->Flag("--still", &options->still,
            "No physics: joints follow their set-points, and nothing has a place");
  sub->Flag("--realtime", &options->realtime, "The clock runs with the wall; lateness is counted");
  sub->Add("--run", &options->run, "The run's name (default: a fresh one)");
  sub->Add("-l,--lcm-url", &options->lcm_url,
           "LCM URL (default: $LCM_DEFAULT_URL, else LCM's own)");
}

const std::string& RunPlan::kinematics(const std::string& type_name) const {
  for (const proto::KinematicsImage& entry : description.kinematics()) {
    if (entry.type_name() == type_name) return entry.image();
  }
  // An empty image is refused wherever one is verified.
  static const std::string none;
  return none;
}

int64_t RunPlan::num_ticks() const {
  if (description.seconds() <= 0) return -1;
  // A time that is shorter than half a tick still is a tick.
  return std::max<int64_t>(1, std::llround(description.seconds() * 1e6 / description.tick_us()));
}

std::optional<RunPlan> PlanRun(const RunOptions& options) {
  if (!CheckNumbers(options)) return std::nullopt;
  // The run's name begins every channel's, so that it must fit there.
  if (!options.run.empty()) {
    if (Result<void> good = bridge::CheckRunName(options.run); !good) {
      return Refuse("--run: " + good.error().message);
    }
  }
  // Model, robot and root module.
  std::optional<model::Model> model = LoadModel({options.model_file});
  if (!model) return std::nullopt;
  const model::Robot* robot = PickRobot(*model, options.robot);
  if (robot == nullptr) return std::nullopt;
  // A module's channel names must fit, and must not be those of something else.
  for (const model::ModuleInstance& module : robot->modules) {
    if (Result<void> good = bridge::CheckModuleName(module.name); !good) {
      return Refuse(good.error().message);
    }
  }
  if (!options.root.empty() && !robot->FindModule(options.root)) {
    return Refuse(fmt::format("--root: robot {} has no module '{}'", robot->name, options.root));
  }
  // The program, compiled against the keywords of all module types of the model.
  const std::optional<CompiledProgram> program =
      LoadProgram(options.program_file, keywords::KeywordsOf(*model));
  if (!program) return std::nullopt;
  // The description holds all of it: what the processes of the run and readers of the log need.
  RunPlan plan;
  Describe(options, *model, *robot, program->image, &plan.description);
  plan.description.set_program_hash(program->hash);
  plan.description.set_run(options.run);
  if (!AddKinematics(*model, *robot, &plan.description)) return std::nullopt;
  if (!options.commands.empty()) {
    std::optional<ControlScript> script = LoadScript(options.commands, *model);
    if (!script) return std::nullopt;
    plan.script = std::move(*script);
  }
  // The index outlives the move of the model; the pointer would not.
  plan.robot_index = static_cast<int>(robot - model->robots.data());
  plan.model = std::move(*model);
  // The robot is built once here, so that options and robots that cannot be simulated are refused
  // before any process starts. The world, where there is one, gives the world hash.
  if (options.still) {
    const auto without_physics = BuildRobot(plan);
    if (!without_physics) return Refuse(without_physics.error().message);
    return plan;
  }
  const auto with_physics = BuildBulletRobot(plan);
  if (!with_physics) return Refuse(with_physics.error().message);
  plan.description.set_world_hash((*with_physics)->world_hash());
  return plan;
}

Result<RunPlan> PlanFromDescription(const std::string& bytes) {
  RunPlan plan;
  if (!plan.description.ParseFromString(bytes)) return Fail("this is no description of a run");
  Result<model::Model> model = model::ParseModel(plan.description.model());
  if (!model) return Fail("the description's model cannot be used: " + model.error().message);
  plan.model = std::move(*model);
  // The description carries the model whole, so another host needs no files.
  const model::Robot* robot = plan.model.FindRobot(plan.description.robot());
  if (robot == nullptr)
    return Fail("the description's model has no robot " + plan.description.robot());
  plan.robot_index = static_cast<int>(robot - plan.model.robots.data());
  return plan;
}

void AddPlanSource(Subcommand* sub, PlanSource* source) {
  sub->Add("FILE", &source->options.model_file, "M3L file");
  sub->Add("PROGRAM", &source->options.program_file, "DynaRole program or image");
  sub->Add("--description", &source->description, "The run's description, instead of the files");
  AddPlanOptions(sub, &source->options);
}

std::optional<RunPlan> LoadPlan(const PlanSource& source) {
  if (source.description.empty()) {
    // By hand all three are needed: without a name sim and log would not find each other.
    if (source.options.model_file.empty() || source.options.program_file.empty() ||
        source.options.run.empty()) {
      return Refuse("expected FILE.m3l PROGRAM.dyn --run NAME, or --description FILE");
    }
    return PlanRun(source.options);
  }
  // As the launcher passes the plan to the processes that it starts.
  const Result<std::string> bytes = ReadFile(source.description);
  Result<RunPlan> plan = bytes ? PlanFromDescription(*bytes) : Fail(bytes.error().message);
  if (!plan) return Refuse(source.description + ": " + plan.error().message);
  return std::move(*plan);
}

RootPose RootPoseOf(const RunPlan& plan, int module) {
  const model::Robot& robot = plan.robot();
  RootPose root;
  // Only the robot's own root module says which of its links is meant.
  root.link = module == robot.root_module ? robot.root_link : 0;
  const model::KinematicState state =
      model::ForwardKinematics(plan.model, robot, model::StartValues(robot));
  root.X_RL = state.X_RL[module][root.link];
  return root;
}

Result<std::unique_ptr<sim::ControlledRobot>> BuildRobot(const RunPlan& plan) {
  if (!plan.description.still()) return BuildBulletRobot(plan);
  return sim::StillRobot::Create(std::make_shared<const model::Model>(plan.model),
                                 plan.robot().name, static_cast<int>(plan.description.tick_us()),
                                 static_cast<int>(plan.description.physics_step_us()));
}

Result<bridge::SimParticipantOptions> SimOptions(const RunPlan& plan, bool logger) {
  bridge::SimParticipantOptions options;
  const proto::RunDescription& d = plan.description;
  options.run = d.run();
  options.model_hash = d.model_hash();
  options.program_hash = d.program_hash();
  options.logger = logger;
  // The pace and the end of the run.
  options.num_ticks = plan.num_ticks();
  options.tick_us = static_cast<int32_t>(d.tick_us());
  options.realtime = d.mode() == "realtime";
  options.speed = d.speed();
  // The sim refuses a HELLO whose type or images are not these.
  const model::Robot& robot = plan.robot();
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    bridge::ExpectedModule expected;
    expected.name = robot.modules[m].name;
    expected.id = static_cast<uint16_t>(m);
    const model::ModuleType& type = plan.model.TypeOf(robot, static_cast<int>(m));
    expected.type_name = type.name;
    expected.num_connectors = static_cast<int>(type.connectors.size());
    // The hash tells a module that was built from another version of the model.
    const Result<uint64_t> hash = KinematicsHash(plan.kinematics(expected.type_name));
    if (!hash) return Fail(hash.error().message);
    expected.kinematics_hash = *hash;
    options.modules.push_back(expected);
  }
  return options;
}

uint64_t ReceiverSeed(uint64_t run_seed, int receiver) {
  // The factor keeps the seeds of neighbouring runs apart; +2 makes the logger's, -1, positive.
  return run_seed * 1000003 + static_cast<uint64_t>(receiver + 2);
}

}  // namespace morphbus::tools
