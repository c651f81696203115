#pragma once
// What a run needs before anything starts: compiled, hashed and described.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/bus/faulty_bus.h"
#include "bridge/lockstep/sim/sim_participant.h"
#include "compiler/model/robot_model.h"
#include "compiler/model/run_description.pb.h"
#include "sim/controlled_robot.h"
#include "tools/base/model_io.h"
#include "tools/base/options.h"
#include "tools/base/program.h"
#include "tools/plan/control_script.h"

namespace morphbus::tools {

/// What the user asked for: the options of `morphbus run`, and of `sim` and `log` where they have
/// them. The command line fills it in; nothing in it has been checked before PlanRun.
struct RunOptions {
  /// Path of the M3L file.
  std::string model_file;
  /// Path of the DynaRole program, as text or as an image.
  std::string program_file;
  /// Name of the robot; empty: the model's only one.
  std::string robot;
  /// Path of a file of settings (--params); empty: none.
  std::string params;
  /// Settings, "NAME=VALUE" (--set): of parameters of the program, and with two dots in the name of
  /// attributes of the model. They come after those of the file, and of two the later one counts.
  std::vector<std::string> set;
  /// What stands before "params" and "set" in messages; of a file its name and line: "r.toml:3: ".
  std::string settings_from = "--";
  double seconds = 0.0;  ///< Sim time; 0: until stopped.
  std::string log;       ///< Path; empty: morphbus-<run>.log here.
  bool no_log = false;   ///< None is written.
  std::string run;       ///< Name; empty: a fresh one.
  std::string root;      ///< Module that broadcasts the root pose; empty: the robot frame's.
  /// Where the bus is; empty: $LCM_DEFAULT_URL, else LCM's own default.
  std::string lcm_url;
  double loss = 0.0;  ///< Fraction of datagrams thrown away at every receiver.
  /// Path of an SDFormat world with obstacles (compiler/world/sdf_world.h); empty: none.
  std::string world;
  /// Path of further faults of the bus (bridge/bus/fault_plan.h); empty: none.
  std::string faults;
  /// Of the random numbers that choose which messages suffer, unless the file names one.
  uint64_t seed = 1;
  /// Of the numbers that the program draws (`random`).
  uint64_t random_seed = 1;
  double speed = 0.0;     ///< Times real time; 0: as fast as possible.
  double friction = 0.8;  ///< Coulomb friction of all contacts.
  /// Whether there is level ground at y = 0 in the world.
  bool ground = true;
  /// The root measures its pose, with noise of standard deviations "METRES,RADIANS" (empty: none).
  bool root_sensor = false;
  std::string root_noise;
  int noise_seed = 1;
  bool realtime = false;  ///< The clock runs with the wall, and nobody waits.
  bool still = false;     ///< No physics: joints follow their set-points.
  bool inproc = false;    ///< One process, no network.
  bool isolate = false;   ///< A private network.
  bool open = false;      ///< No key: whoever reaches the bus can speak in the run.
  /// Path of the run's key; empty: a fresh one, unless the run is open.
  std::string key_file;
  bool force = false;  ///< The log replaces any file.
  /// The result is printed as one JSON object.
  bool json = false;
  int repeat = 1;     ///< Runs one after the other.
  int processes = 0;  ///< That share the modules; 0: one a module.
  /// Path of commands and the ticks at which they are given; empty: none.
  std::string commands;
  /// Modules to lose on purpose, "m3@12.5": the run goes on without m3 from 12.5 s of sim time on.
  std::vector<std::string> lose;
};

/// Adds the options that say what runs: files, robot, and what goes into the run's description.
void AddPlanOptions(Subcommand* sub, RunOptions* options);

/// A run ready to start: its description is what goes into the log, the rest is read from it. Plain
/// data, made by PlanRun or PlanFromDescription; it lives as long as the run.
struct RunPlan {
  /// Everything that decides how the run goes: compiled model, images, options, hashes. What
  /// another process or a reader of the log needs is here, so that neither needs the source files.
  proto::RunDescription description;
  /// The description's model, parsed.
  model::Model model;
  /// Which robot of `model` runs.
  int robot_index = 0;
  /// What is done to the robot while it runs.
  ControlScript script;
  /// What befalls messages at their receivers: the description's loss and faults together.
  bridge::FaultPlan faults;

  /// The robot that runs; it belongs to this plan.
  [[nodiscard]] const model::Robot& robot() const { return model.robots[robot_index]; }
  /// The kinematics image of a module type.
  /// It is empty for a type that the robot does not use.
  [[nodiscard]] const std::string& kinematics(const std::string& type_name) const;
  /// Control ticks of the whole run; -1: until stopped.
  [[nodiscard]] int64_t num_ticks() const;
};

/// Whether the numbers of the options are good; says which one is out of its range.
bool CheckNumbers(const RunOptions& options);

/// Compiles and describes a run; what is wrong with the input is printed, and the result is then
/// empty. The run's name is the one that was asked for, or left empty for the caller to choose. The
/// world is built once, to learn the world hash.
/// @param source  if not null, gets where the model is written.
std::optional<RunPlan> PlanRun(const RunOptions& options, ModelSource* source = nullptr);
/// The same with a model and a program that are compiled already, for several plans of them; the
/// options' numbers (CheckNumbers) and name of the run must be good.
std::optional<RunPlan> PlanCompiled(const RunOptions& options, model::Model model,
                                    const CompiledProgram& program);

/// The plan that a description stands for: what a sim or a logger needs in a process of its own.
/// `bytes` is a serialized RunDescription. Fails if it is none, or if its model cannot be used.
Result<RunPlan> PlanFromDescription(const std::string& bytes);

/// What `morphbus sim` and `morphbus log` run: --description FILE, or the same files and options as
/// `morphbus run`, with --run. Prints what is wrong.
struct PlanSource {
  RunOptions options;
  /// Path of a serialized RunDescription; empty: the files and options of `options`.
  std::string description;
};
/// The plan that `source` names; empty, after printing why, if it cannot be used.
std::optional<RunPlan> LoadPlan(const PlanSource& source);
/// Adds the options of a PlanSource.
void AddPlanSource(Subcommand* sub, PlanSource* source);

/// The link of a module that stands for it as the root, and its pose at the start values.
struct RootPose {
  /// Index of the link L in the module type: the robot's root link if the module is the robot's
  /// root module, else its first link.
  int link = 0;
  /// The pose of L in the robot frame R (metres).
  model::Pose X_RL = model::Pose::Identity();
};
/// What the module of this index broadcasts if it is the root (--root).
RootPose RootPoseOf(const RunPlan& plan, int module);

/// The robot of the plan at its start values: in a fresh Bullet world, or without physics if the
/// description says so. Fails, in one sentence, if an option of the description makes no sense.
Result<std::unique_ptr<sim::ControlledRobot>> BuildRobot(const RunPlan& plan);

/// The sim's side of the lockstep for this plan: its timing, and which modules it waits for.
/// `logger` says whether it waits for a logger too. Fails if a kinematics image is damaged.
Result<bridge::SimParticipantOptions> SimOptions(const RunPlan& plan, bool logger);

}  // namespace morphbus::tools
