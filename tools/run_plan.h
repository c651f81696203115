#pragma once
// What a run needs before anything starts: compiled, hashed and described.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bridge/sim_party.h"
#include "compiler/model/robot_model.h"
#include "compiler/model/run_description.pb.h"
#include "sim/simulated_assembly.h"
#include "tools/cli.h"

namespace CLI {
class App;
}

namespace morphbus::tools {

struct RunOptions {
  std::string model_file;
  std::string program_file;
  std::string robot;
  double seconds = 0.0;  ///< Sim time; 0: until stopped.
  std::string log;       ///< Path; empty: morphbus-<run>.log here.
  std::string run;       ///< Name; empty: a fresh one.
  std::string root;      ///< Module that broadcasts the root pose; empty: the robot frame's.
  std::string lcm_url;
  double loss = 0.0;  ///< Fraction of datagrams thrown away at every receiver.
  uint64_t seed = 1;
  double speed = 0.0;  ///< Times real time; 0: as fast as possible.
  double friction = 0.8;
  bool ground = true;
  bool realtime = false;
  bool inproc = false;
  bool isolate = false;
  bool json = false;
  int repeat = 1;
};

/// Adds the options that say what runs: files, robot, and what goes into the run's description.
void AddPlanOptions(CLI::App* sub, RunOptions* options);

struct RunPlan {
  proto::RunDescription description;
  model::Model model;
  int robot_index = 0;

  [[nodiscard]] const model::Robot& robot() const {
    return model.robots[static_cast<size_t>(robot_index)];
  }
  /// The kinematics image of a module type.
  [[nodiscard]] const std::string& kinematics(const std::string& type_name) const;
  /// -1: until stopped.
  [[nodiscard]] int64_t num_ticks() const;
};

/// Compiles and describes a run; what is wrong with the input is printed. The run's name is left
/// open.
std::optional<RunPlan> PlanRun(const RunOptions& options);

/// The plan that a description stands for: what a sim or a logger needs in a process of its own.
Result<RunPlan> PlanFromDescription(const std::string& bytes);

/// What `morphbus sim` and `morphbus log` run: --description FILE, or the same files and options as
/// `morphbus run`, with --run. Prints what is wrong.
struct PlanSource {
  RunOptions options;
  std::string description;
};
std::optional<RunPlan> LoadPlan(const PlanSource& source);
void AddPlanSource(CLI::App* sub, PlanSource* source);

/// The link of module `m` that stands for it as the root, and its pose X_RL at the start values.
struct RootPose {
  int link = 0;
  model::Pose X_RL = model::Pose::Identity();
};
RootPose RootPoseOf(const RunPlan& plan, int module);

/// The robot of the plan in a fresh Bullet world.
Result<std::unique_ptr<sim::SimulatedAssembly>> BuildAssembly(const RunPlan& plan);

/// The sim's side of the lockstep for this plan.
Result<bridge::SimPartyOptions> SimOptions(const RunPlan& plan, bool logger);

/// Seed of one receiver's losses: unlike for each, the same in every way of running.
inline constexpr int kLogReceiver = -1;
inline constexpr int kSimReceiver = 0;
inline constexpr int kFirstModuleReceiver = 1;
uint64_t ReceiverSeed(uint64_t run_seed, int receiver);

}  // namespace morphbus::tools
