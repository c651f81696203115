#pragma once
// The module process: images from files, one bus, one or several modules. A launcher starts one
// process for each module, or one for many.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridge/bus/faulty_bus.h"
#include "bridge/module/module_instance.h"
#include "bridge/wire/run_key.h"

namespace morphbus::bridge {

/// One module of the process; the robot's description, which the launcher reads, says what it is.
struct ModuleChoice {
  /// Name and number in the model.
  std::string name;
  uint16_t id = 0;
  /// File with the kinematics image of its type.
  std::string kinematics_file;
  /// Counts the module's cold starts, from 1.
  uint32_t incarnation = 1;
};

/// What the command line told the module process (module_main.cc), checked as far as possible
/// without opening a file. What holds for all modules stands in ModuleIdentity, where name, number
/// and claim are filled in for each.
struct ModuleProcessOptions : ModuleIdentity {
  std::vector<ModuleChoice> modules;
  /// File with the program image, which all modules run.
  std::string program_file;
  std::optional<ModuleSpec::Root> root;  ///< Absent: none of these modules is the root.
  /// Which of the modules is the root, if there are several; empty: the only one.
  std::string root_module;
  std::string lcm_url;  ///< Empty: $LCM_DEFAULT_URL, else LCM's default.
  RunKey key;           ///< The run's.
  /// What befalls messages that arrive here; each module has its own faults.
  FaultPlan faults;
  std::string
      snapshot_file;    ///< Where each answer is saved before it is published; empty: nowhere.
  bool resume = false;  ///< Go on from there.
};

/// Exit status of a process that was to resume and cannot use the state that was saved. It has
/// removed the file: the module's next process has to begin anew, under a later incarnation.
inline constexpr int kStateUnusable = 4;

/// Exit status of the process, as the command line's: 0 the run ended, 2 unusable input, 3 it
/// failed, kStateUnusable. What went wrong is on stderr, one sentence. Runs until the sim ends the
/// run, or SIGINT or SIGTERM.
int RunModuleProcess(const ModuleProcessOptions& options);

}  // namespace morphbus::bridge
