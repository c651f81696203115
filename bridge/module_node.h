#pragma once
// The module process: images from files, one bus, one or several modules.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bridge/retry_timer.h"
#include "vm/pose.h"

namespace morphbus::bridge {

/// One module of the process.
struct ModuleChoice {
  std::string name;
  uint16_t id = 0;
  std::string kinematics_file;
};

struct ModuleNodeOptions {
  std::string run;
  std::vector<ModuleChoice> modules;
  std::string program_file;
  /// The link whose pose the module broadcasts, and that pose in the robot frame (m); absent: none
  /// of these modules is the root.
  std::optional<uint8_t> root_link;
  vm::PoseF X_RL_root;
  std::string root_module;  ///< Which of them, if there are several; empty: the only one.
  std::string lcm_url;      ///< Empty: $LCM_DEFAULT_URL, else LCM's default.
  uint32_t incarnation = 1;
  double loss = 0;
  uint64_t seed = 0;
  bool realtime = false;
  std::string
      snapshot_file;    ///< Where each answer is saved before it is published; empty: nowhere.
  bool resume = false;  ///< Go on from there.
  std::string build;    ///< Version of the software, for HELLO.
  LockstepTiming timing;
};

/// Exit status of the process, as the command line's: 0 the run ended, 2 unusable input, 3 it
/// failed. What went wrong is on stderr, one sentence. Runs until the sim ends the run, or SIGINT
/// or SIGTERM.
int RunModuleNode(const ModuleNodeOptions& options);

}  // namespace morphbus::bridge
