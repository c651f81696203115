// morphbus-module: the process that is a module. Small on purpose: a hundred of them run on one
// machine. This file reads the command line; bridge/module/module_process.h does the rest.

#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "bridge/bus/fault_plan.h"
#include "bridge/module/module_process.h"
#include "compiler/base/quantity.h"
#include "compiler/base/standard_streams.h"
#include "compiler/base/version.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::bridge {
namespace {

/// The command line as it was typed, before it is checked as a whole.
struct Arguments {
  ModuleProcessOptions process;
  // One entry for each module; --kinematics may have one for all.
  std::vector<std::string> modules;
  std::vector<uint16_t> ids;
  std::vector<std::string> kinematics;
  std::vector<uint32_t> incarnations = {1};
  // The root's link and its pose, if one of the modules is the root: x, y, z (m), then w, x, y, z.
  std::vector<double> root_pose;
  int root_link = -1;
  // What befalls messages on their way here: a share that is lost, a file of rules, and the seed of
  // the random numbers.
  double loss = 0;
  std::string faults_file;
  // The run's key, or that it has none.
  std::string key_file;
  bool open = false;
  uint64_t seed = 1;
  // Seconds without the sim after which the process gives up.
  double give_up_s = 10;
  int64_t tick_us = 20000;
  bool survive_parent = false;
};

/// Leaves CLI11 a plain number of what people write with its unit.
CLI::Validator InUnits(const QuantityReader& reader) {
  return CLI::Validator([&reader](std::string& text) { return MakePlain(reader, &text); }, "");
}

/// Declares every option; CLI11 checks single values and fills in `a`.
void AddOptions(CLI::App* app, Arguments* a) {
  // Who the modules are.
  app->add_option("--run", a->process.run, "The run's name")->required();
  app->add_option("--module,--modules", a->modules, "Name of the module, or several: m1,m2,...")
      ->delimiter(',')
      ->required();
  app->add_option("--id", a->ids, "Its number in the run (several: 0,1,...)")
      ->delimiter(',')
      ->required();
  app->add_option("--kinematics", a->kinematics,
                  "Kinematics image of its type (several types: one for each module)")
      ->delimiter(',')
      ->required();
  app->add_option("--program", a->process.program_file, "Program image")->required();
  // Which of them knows from the start where it is.
  app->add_option("--root-link", a->root_link,
                  "The module is the root and broadcasts this link's pose (number of the link)")
      ->check(CLI::Range(0, 127));
  app->add_option("--root-pose", a->root_pose,
                  "That pose in the robot frame: x,y,z,w,x,y,z (metres, quaternion)")
      ->delimiter(',')
      ->expected(7);
  app->add_option("--root-module", a->process.root_module,
                  "With several modules: which one is the root");
  // How the process takes part in the run.
  app->add_option("--key", a->key_file, "File with the run's key");
  app->add_flag("--open", a->open, "The run has no key: whoever reaches the bus can speak in it");
  app->add_option("--lcm-url", a->process.lcm_url, "LCM URL (default: $LCM_DEFAULT_URL)");
  app->add_option("--incarnation", a->incarnations,
                  "Counts the module's cold starts, from 1 (several modules: one for each)")
      ->delimiter(',')
      ->check(CLI::Range(1, 1'000'000'000));
  app->add_option("--restarts", a->process.restarts,
                  "How often the process died and was started again; told in HEALTH")
      ->check(CLI::Range(0, 1'000'000'000));
  app->add_option("--loss", a->loss, "Fraction of what arrives to throw away, 0..1")
      ->transform(InUnits(kFractionReader));
  app->add_option("--faults", a->faults_file,
                  "File of rules by which messages are lost, doubled, late or damaged");
  app->add_option("--seed", a->seed, "Seed of --loss and --faults");
  app->add_option("--random-seed", a->process.random_seed,
                  "Seed of the numbers that the program draws");
  app->add_flag("--realtime", a->process.realtime,
                "Act on what is there instead of waiting for it");
  app->add_option("--tick-us", a->tick_us,
                  "Control tick, microseconds; told by the sim, for information");
  // What happens when it is killed, or left alone.
  app->add_option("--snapshot", a->process.snapshot_file,
                  "File to save the state in before every answer, so that --resume can go on");
  app->add_flag(
      "--resume", a->process.resume,
      "Go on from --snapshot after the process was killed; a module of a later incarnation "
      "begins anew at the tick that follows");
  app->add_option("--give-up", a->give_up_s, "Exit after so many seconds without the sim")
      ->transform(InUnits(kSecondsReader))
      ->check(CLI::Range(1.0, 1e6));
  app->add_flag("--survive-parent", a->survive_parent, "Keep running when the parent process dies");
}

/// What is wrong with the command line, on stderr.
int Refuse(const std::string& why) {
  std::fprintf(stderr, "morphbus-module: error: %s\n", why.c_str());
  return 2;
}

/// Says what is wrong with the options, a misspelt one with the nearest that there is. --help and
/// --version end here too, with status 0.
int RefuseOptions(const CLI::App& app, const CLI::ParseError& error) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  // CLI11 leaves over what it could not assign; an option among it is one that nobody defined.
  for (const std::string& argument : app.remaining()) {
    if (!argument.starts_with("-")) continue;
    const std::string name = argument.substr(0, argument.find('='));
    const std::string nearest = source::NearestName(name, names);
    return Refuse("there is no option '" + name + "'" +
                  (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
  }
  return app.exit(error) == 0 ? 0 : 2;
}

/// Reads the file of --faults, if there is one. What is wrong with it is on stderr; false then.
bool ReadFaults(Arguments* a) {
  FaultPlan faults;
  if (!a->faults_file.empty()) {
    source::SourceSet sources;
    source::Diagnostics diagnostics;
    const Result<int> file = sources.AddFile(a->faults_file);
    if (!file) {
      Refuse("--faults: " + file.error().message);
      return false;
    }
    // Which other modules there are, nobody has told this one.
    std::optional<FaultPlan> read = ParseFaultPlan(sources, *file, {}, &diagnostics);
    std::fputs(source::Render(diagnostics, sources, false).c_str(), stderr);
    if (!read) return false;
    faults = std::move(*read);
  }
  a->process.faults = WithLoss(std::move(faults), a->loss, a->seed);
  return true;
}

/// Reads the run's key. What is wrong with it is on stderr; false then.
bool ReadKey(Arguments* a) {
  if (a->open != a->key_file.empty()) {
    Refuse("expected --key FILE, with the key of the run, or --open for a run that has none");
    return false;
  }
  if (a->open) return true;
  const Result<RunKey> key = RunKey::Read(a->key_file);
  if (!key) {
    Refuse("--key: " + key.error().message);
    return false;
  }
  a->process.key = *key;
  return true;
}

/// Checks what single options cannot show, and runs the process. Returns the exit status.
int Run(Arguments* a) {
  // Lists must go together: one id a module, one image for all or one for each.
  const size_t count = a->modules.size();
  if (a->ids.size() != count) return Refuse("--id needs one number for each module");
  if (a->kinematics.size() != 1 && a->kinematics.size() != count) {
    return Refuse("--kinematics needs one image, or one for each module");
  }
  if (a->incarnations.size() != 1 && a->incarnations.size() != count) {
    return Refuse("--incarnation needs one number, or one for each module");
  }
  for (size_t i = 0; i < count; ++i) {
    a->process.modules.push_back({a->modules[i], a->ids[i],
                                  a->kinematics[a->kinematics.size() == 1 ? 0 : i],
                                  a->incarnations[a->incarnations.size() == 1 ? 0 : i]});
  }
  if (!ReadKey(a) || !ReadFaults(a)) return 2;
  if (a->process.resume && a->process.snapshot_file.empty())
    return Refuse("--resume needs --snapshot");
  // The root's pose must be a pose, and it must be clear whose it is.
  if (a->root_link >= 0) {
    if (a->root_pose.size() != 7) return Refuse("--root-link needs --root-pose");
    if (count > 1 && a->process.root_module.empty())
      return Refuse("--root-link needs --root-module");
    std::array<float, 7> p = {};
    double norm = 0;
    for (size_t i = 0; i < 7; ++i) {
      if (!std::isfinite(a->root_pose[i])) return Refuse("--root-pose holds a number that is none");
      p[i] = static_cast<float>(a->root_pose[i]);
      if (i >= 3) norm += a->root_pose[i] * a->root_pose[i];
    }
    // The digits of a command line are few, so the length need not be exact.
    if (!(std::abs(norm - 1) < 1e-3)) return Refuse("--root-pose needs a quaternion of length 1");
    a->process.root = ModuleSpec::Root{static_cast<uint8_t>(a->root_link),
                                       {{p[0], p[1], p[2]}, {p[3], p[4], p[5], p[6]}}};
  }
  a->process.timing.lost_us = static_cast<int64_t>(a->give_up_s * 1e6);
  return RunModuleProcess(a->process);
}

}  // namespace
}  // namespace morphbus::bridge

int main(int argc, char** argv) {
  morphbus::PrepareStandardStreams();
  // The parent is asked for first, so that its death later in this function shows.
  const pid_t parent = getppid();
  morphbus::bridge::Arguments arguments;
  CLI::App app(
      "One module of a running robot: its virtual machine, on the bus.\n"
      "Example: morphbus-module --run walk --module m1 --id 0 --kinematics MTRAN.kinematics "
      "--program walk.image --key walk.key");
  app.name("morphbus-module");
  app.set_version_flag("--version", std::string("morphbus-module ") + morphbus::Version());
  morphbus::bridge::AddOptions(&app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return morphbus::bridge::RefuseOptions(app, error);
  }
  if (!arguments.survive_parent) {
    // A module must not outlive its launcher; if that died before this line, we see another parent.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) return 3;
  }
  arguments.process.build = morphbus::Version();
  return morphbus::bridge::Run(&arguments);
}
