#include "tools/plan/run_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "bridge/bus/fault_plan.h"
#include "bridge/description/run_model.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/wire_limits.h"
#include "compiler/base/quantity.h"
#include "compiler/base/version.h"
#include "compiler/dynarole/compile.h"
#include "compiler/emit/kinematics.h"
#include "compiler/keywords/module_keywords.h"
#include "compiler/model/forward_kinematics.h"
#include "compiler/model/model_proto.h"
#include "compiler/world/sdf_world.h"
#include "compiler/world/surface_files.h"
#include "compiler/world/world_proto.h"
#include "sim/arithmetic.h"
#include "sim/bullet_robot.h"
#include "sim/still_robot.h"
#include "tools/base/files.h"
#include "tools/base/messages.h"
#include "tools/machine/run_registry.h"
#include "tools/plan/settings.h"

namespace morphbus::tools {
namespace {

/// Control period, microseconds; sensors and commands are exchanged once a tick.
constexpr uint32_t kTickUs = 20000;
/// Step of the physics, microseconds, and iterations of its solver: part of the world hash.
constexpr uint32_t kPhysicsStepUs = 1000;
constexpr uint32_t kSolverIterations = 30;

/// What stands in the world by the description.
Result<void> AddObstacles(const proto::RunDescription& d, std::vector<world::Obstacle>* obstacles) {
  Result<std::vector<world::Obstacle>> read = world::ReadWorld(d);
  if (!read) return Fail("the description's world cannot be used: " + read.error().message);
  *obstacles = std::move(*read);
  return {};
}

/// The robot in a fresh Bullet world.
Result<std::unique_ptr<sim::BulletRobot>> BuildBulletRobot(const RunPlan& plan) {
  sim::BulletRobotOptions options;
  // All that the world hash covers comes from the description, so that every process builds the
  // same world.
  options.world.friction = plan.description.friction();
  options.world.ground = plan.description.ground();
  options.noise_seed = plan.description.noise_seed();
  if (Result<void> read = AddObstacles(plan.description, &options.world.obstacles); !read) {
    return Fail(read.error().message);
  }
  options.world.solver_iterations = static_cast<int>(plan.description.solver_iterations());
  options.tick_us = static_cast<int>(plan.description.tick_us());
  options.physics_step_us = static_cast<int>(plan.description.physics_step_us());
  return sim::BulletRobot::Create(std::make_shared<const model::Model>(plan.model),
                                  plan.robot().name, options);
}

/// The two standard deviations of --root-noise, "0.002,0.01" or "0.002,0.5deg" (m, rad), 0 to 1
/// each. Both are 0 if the option is empty; nothing if it says anything else.
std::optional<std::array<double, 2>> ReadNoise(const std::string& text) {
  std::array<double, 2> noise = {0, 0};
  if (text.empty()) return noise;
  const size_t comma = text.find(',');
  if (comma == std::string::npos) return std::nullopt;
  const std::optional<double> length = ReadPlainNumber(text.substr(0, comma));
  const std::optional<double> turn = ReadRadians(text.substr(comma + 1));
  if (!length || !turn) return std::nullopt;
  noise = {*length, *turn};
  const bool usual = std::ranges::all_of(noise, [](double n) { return n >= 0 && n <= 1; });
  return usual ? std::optional(noise) : std::nullopt;
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
  d->set_open(options.open);
  // How the root knows where it is.
  d->set_root_sensor(options.root_sensor);
  const std::array<double, 2> noise = ReadNoise(options.root_noise).value();
  d->set_root_noise_m(noise[0]);
  d->set_root_noise_rad(noise[1]);
  d->set_noise_seed(static_cast<uint64_t>(options.noise_seed));
  // What is thrown away on purpose.
  d->set_random_seed(options.random_seed);
  d->set_seed(options.seed);
  d->set_loss(options.loss);
  // In real time the pace defaults to that of the wall, in lockstep to as fast as it goes.
  d->set_mode(options.realtime ? "realtime" : "lockstep");
  d->set_speed(options.realtime && options.speed == 0 ? 1.0 : options.speed);
  d->set_build(Version());
  d->set_arithmetic(sim::ArithmeticFingerprint());
  d->set_started(WallTime());
}

/// No file of faults is larger than this, bytes.
constexpr size_t kMostFaultsBytes = 64u << 10;

/// What befalls messages by the description: the rules of its text, and its loss. Nothing, after
/// printing where `name` is wrong, if the text cannot be used.
std::optional<bridge::FaultPlan> FaultsOf(const proto::RunDescription& description,
                                          const model::Robot& robot, const std::string& name) {
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const int file = sources.AddText(name, description.faults());
  std::optional<bridge::FaultPlan> faults =
      bridge::ParseFaultPlan(sources, file, NamesOf(robot.modules), &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  if (!faults) return std::nullopt;
  return bridge::WithLoss(std::move(*faults), description.loss(), description.seed());
}

/// No world is larger than this, bytes: its text travels in the description.
constexpr size_t kMostWorldBytes = 1u << 20;
/// Nor with what its files hold; that leaves half of the description to model and program.
constexpr size_t kMostSurfaceBytes = bridge::kMaxInfoBytes / 2;

/// Reads the file of --world, if there is one, into the description; prints what is wrong with it.
bool AddWorld(const RunOptions& options, proto::RunDescription* d) {
  if (options.world.empty()) return true;
  if (options.still) {
    Unusable("--world has obstacles, which nothing meets under --still");
    return false;
  }
  const Result<std::string> text = ReadFile(options.world, kMostWorldBytes);
  if (!text) {
    Unusable("--world: " + text.error().message);
    return false;
  }
  // The world is read here for its meshes and its ground, and to find mistakes before anything
  // starts. Processes read the obstacles from the description.
  source::SourceSet sources;
  source::Diagnostics diagnostics;
  const std::optional<world::SdfWorld> world =
      world::ReadSdfWorld(sources, sources.AddText(options.world, *text),
                          world::FilesBeside(options.world), &diagnostics);
  PrintDiagnostics(diagnostics, sources);
  if (!world) return false;
  d->set_world(*text);
  world::KeepSurfaces(world->surfaces, d);
  if (d->ByteSizeLong() > kMostSurfaceBytes) {
    Unusable(fmt::format("--world: with its meshes and height maps it has {} bytes, the most is {}",
                         d->ByteSizeLong(), kMostSurfaceBytes));
    return false;
  }
  d->set_world_file(options.world);
  // The world's own ground says how it grips, unless --friction does.
  if (world->ground_friction && options.friction == RunOptions().friction) {
    d->set_friction(*world->ground_friction);
  }
  return true;
}

/// Reads the file of --faults, if there is one, and adds what befalls messages to the plan.
bool AddFaults(const RunOptions& options, const model::Robot& robot, RunPlan* plan) {
  if (!options.faults.empty()) {
    const Result<std::string> text = ReadFile(options.faults, kMostFaultsBytes);
    if (!text) {
      Unusable("--faults: " + text.error().message);
      return false;
    }
    plan->description.set_faults(*text);
    plan->description.set_faults_file(options.faults);
  }
  std::optional<bridge::FaultPlan> faults = FaultsOf(plan->description, robot, options.faults);
  if (!faults) return false;
  plan->faults = std::move(*faults);
  return true;
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

/// Adds a module that is lost on purpose to the run's script. Says what is wrong with the text.
bool AddLoss(const std::string& text, const model::Robot& robot, RunPlan* plan) {
  const size_t at = text.rfind('@');
  const std::optional<double> seconds =
      ReadSeconds(std::string_view(text).substr(std::min(at, text.size() - 1) + 1));
  const double ticks = seconds.value_or(0) * 1e6 / plan->description.tick_us();
  // Tick 0 waits for all to join, so that the first one without somebody is tick 1.
  if (at == std::string::npos || at == 0 || !(ticks >= 1 && ticks <= 1e12)) {
    Unusable(fmt::format("--lose: expected MODULE@SECONDS, from {} s on, not '{}'",
                         plan->description.tick_us() * 1e-6, text));
    return false;
  }
  bridge::ControlCommand command;
  command.kind = bridge::ControlKind::kLose;
  command.part.module = text.substr(0, at);
  if (const Result<int> module = FindModule(robot, command.part.module); !module) {
    Unusable("--lose: " + module.error().message);
    return false;
  }
  InsertInOrder({std::llround(ticks), std::move(command)}, &plan->script);
  return true;
}

/// The robot that runs. Nothing, after saying why, if it has no such root module, or a module whose
/// name cannot be used on the bus.
const model::Robot* RobotOf(const RunOptions& options, const model::Model& model) {
  const model::Robot* robot = PickRobot(model, options.robot);
  if (robot == nullptr) return nullptr;
  // A module's channel names must fit, and must not be those of something else.
  for (const model::ModuleInstance& module : robot->modules) {
    if (Result<void> good = bridge::CheckModuleName(module.name); !good) {
      Unusable(good.error().message);
      return nullptr;
    }
  }
  if (!options.root.empty() && !robot->FindModule(options.root)) {
    Unusable(fmt::format("--root: robot {} has no module '{}'", robot->name, options.root));
    return nullptr;
  }
  return robot;
}

}  // namespace

void AddPlanOptions(Subcommand* sub, RunOptions* options) {
  sub->Robot(&options->robot);
  sub->Add("--seconds", &options->seconds, "Sim time to run (default, and 0: until stopped)")
      .Seconds();
  sub->Add("--loss", &options->loss,
           "Fraction of datagrams thrown away at every receiver, up to 0.9")
      .Fraction();
  sub->Add("--faults", &options->faults,
           "File of rules by which messages are lost, doubled, late or damaged")
      .TypeName("FILE");
  sub->Seed(&options->seed, "Seed of --loss and --faults (default 1)");
  sub->Add("--random-seed", &options->random_seed,
           "Seed of the numbers that the program draws by random() (default 1)");
  sub->Add("--speed", &options->speed, "Times real time (default: as fast as possible)");
  AddSettings(sub, &options->params, &options->set);
  sub->Add("--root", &options->root,
           "Module that broadcasts the root pose (default: the robot frame's)")
      .TypeName("MODULE");
  sub->Flag("--root-sensor", &options->root_sensor,
            "The root measures its pose, tick by tick (default: it has that of the model)");
  sub->Add("--root-noise", &options->root_noise,
           "The sensor's noise: standard deviations of each coordinate and turn")
      .TypeName("M,RAD");
  sub->Add("--noise-seed", &options->noise_seed,
           "Seed of --root-noise, of the noise of sensors and of mass_spread (default 1)")
      .Range(0, 1'000'000'000);
  sub->Add("--world", &options->world,
           "SDFormat file whose static boxes, cylinders, spheres, planes, meshes and height maps "
           "are obstacles")
      .TypeName("FILE.sdf");
  sub->Add("--friction", &options->friction, "Coulomb friction of everything (default: 0.8)");
  sub->Add("--ground", &options->ground, "Level ground at y = 0: true or false (default: true)")
      .TypeName("true|false");
  sub->Flag("--still", &options->still,
            "No physics: joints follow their set-points, and nothing has a place");
  sub->Flag("--realtime", &options->realtime,
            "The clock waits for nobody: it runs with the wall, with --inproc in virtual time; "
            "lateness is counted");
  sub->Flag("--open", &options->open,
            "No key: whoever reaches the bus can speak in the run, such as hardware of others");
  sub->Add("--run", &options->run, "The run's name (default: a fresh one)").TypeName("NAME");
  sub->Add("-l,--lcm-url", &options->lcm_url, "LCM URL (default: $LCM_DEFAULT_URL, else LCM's own)")
      .TypeName("URL");
}

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
         demand(options.root_sensor || options.root_noise.empty(),
                "--root-noise is that of a sensor: add --root-sensor") &&
         demand(!(options.root_sensor && options.still),
                "--root-sensor measures a place, which nothing has under --still") &&
         demand(ReadNoise(options.root_noise).has_value(),
                "--root-noise: expected metres and radians, 0 to 1 each: 0.002,0.01 or "
                "0.002,0.5deg") &&
         demand(options.friction >= 0 && options.friction <= 10, "--friction: expected 0 to 10");
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

std::optional<RunPlan> PlanRun(const RunOptions& options, ModelSource* source) {
  // What is wrong with the options and the robot is said before what is wrong with the program.
  if (!CheckNumbers(options)) return std::nullopt;
  // The run's name begins every channel's, so that it must fit there.
  if (!options.run.empty()) {
    if (Result<void> good = bridge::CheckRunName(options.run); !good) {
      return Refuse("--run: " + good.error().message);
    }
  }
  std::optional<model::Model> model = LoadModel({options.model_file}, source);
  if (!model || RobotOf(options, *model) == nullptr) return std::nullopt;
  // The program, compiled against the keywords of all module types of the model.
  const std::optional<CompiledProgram> program =
      LoadProgram(options.program_file, keywords::KeywordsOf(*model));
  if (!program) return std::nullopt;
  return PlanCompiled(options, std::move(*model), *program);
}

std::optional<RunPlan> PlanCompiled(const RunOptions& options, model::Model model,
                                    const CompiledProgram& compiled) {
  const std::optional<std::vector<Setting>> settings =
      ReadSettings(options.params, options.set, options.settings_from);
  CompiledProgram program = compiled;
  if (!settings || !SetParameters(*settings, &program)) return std::nullopt;
  const model::Robot* robot = RobotOf(options, model);
  if (robot == nullptr) return std::nullopt;
  // The description holds all of it: what the processes of the run and readers of the log need.
  RunPlan plan;
  // What is set of the model comes before all that is made of it.
  if (!SetAttributes(*settings, &model, &plan.description)) return std::nullopt;
  Describe(options, model, *robot, program.image, &plan.description);
  plan.description.set_program_hash(program.hash);
  plan.description.set_run(options.run);
  if (!AddKinematics(model, *robot, &plan.description)) return std::nullopt;
  if (!AddFaults(options, *robot, &plan)) return std::nullopt;
  if (!AddWorld(options, &plan.description)) return std::nullopt;
  // What is done to the run from outside: commands of a file, and modules that are lost on purpose.
  if (!options.commands.empty()) {
    std::optional<ControlScript> script = LoadScript(options.commands, model);
    if (!script) return std::nullopt;
    plan.script = std::move(*script);
  }
  for (const std::string& text : options.lose) {
    if (!AddLoss(text, *robot, &plan)) return std::nullopt;
  }
  // The index outlives the move of the model; the pointer would not.
  plan.robot_index = static_cast<int>(robot - model.robots.data());
  plan.model = std::move(model);
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
  // This one is thrown away, so that looking for contacts changes no run.
  if (Result<void> free = (*with_physics)->CheckStart(); !free) {
    return Refuse(
        fmt::format("--world {}: {}", plan.description.world_file(), free.error().message));
  }
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
  std::optional<bridge::FaultPlan> faults = FaultsOf(plan.description, *robot, "the faults");
  if (!faults) return Fail("the description's faults cannot be used");
  plan.faults = std::move(*faults);
  return plan;
}

void AddPlanSource(Subcommand* sub, PlanSource* source) {
  sub->Add("FILE.m3l", &source->options.model_file, "M3L file");
  sub->Add("PROG.dyn", &source->options.program_file, "DynaRole program or image");
  sub->Add("--description", &source->description, "The run's description, instead of the files")
      .TypeName("FILE");
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
  root.link = bridge::RootLinkOf(robot, module).link;
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
  options.end_reason = d.end_reason();
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

}  // namespace morphbus::tools
