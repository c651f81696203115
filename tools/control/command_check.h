#pragma once
// Whether a command fits the run that it is given to.

#include <cstdint>
#include <functional>
#include <string>

#include "bridge/control/control_command.h"
#include "compiler/model/robot_model.h"
#include "tools/control/given_command.h"
#include "tools/control/run_images.h"

namespace morphbus::tools {

/// Why a command is refused: the exit status of who gave it, 0 for none, and the reason, a sentence
/// for people.
struct Refusal {
  int status = 0;
  std::string reason;
  /// Whether there is one.
  explicit operator bool() const { return status != 0; }
};

/// Holds commands against the robot that runs, its programs, and what is known of its modules.
/// Nothing here depends on the tick.
class CommandCheck {
 public:
  /// What the simulator knows of a module (by its place in the robot) now.
  struct ModuleStates {
    /// Whether it was lost on purpose, or will be before the next tick.
    std::function<bool(int module)> lost;
    /// Hash of the program that it ran when it was heard of last; 0 before.
    std::function<uint64_t(int module)> program;
  };

  /// @param root  name of the module that gets what is addressed to none.
  /// `model`, its `robot` and `images` outlive the check.
  CommandCheck(const model::Model& model, const model::Robot& robot, const std::string& root,
               RunImages* images, ModuleStates states);

  /// What can be said against a command before its tick, whatever the modules answer until then:
  /// the names in it, and the program that it deploys.
  Refusal Check(const bridge::ControlCommand& command);
  /// Whether it fits the program that its module runs, as of its last answer. At the command's tick
  /// all answers to the one before are there; earlier, that is a matter of time, and no reason to
  /// refuse what was done in the run that a script repeats.
  Refusal CheckProgram(const bridge::ControlCommand& command);

  /// The place in the robot of the module that a command is addressed to by `--to`. Everything
  /// spreads from the root as well as from anywhere.
  [[nodiscard]] int Addressee(const bridge::ControlCommand& command) const;
  /// The place in the robot of the module that it is about; it passed Check.
  [[nodiscard]] int ModuleOf(const bridge::ControlCommand& command) const;
  /// Modules of the robot.
  [[nodiscard]] size_t num_modules() const { return robot_.modules.size(); }

 private:
  /// Are all modules, links and connectors that it names there?
  [[nodiscard]] Refusal CheckNames(const bridge::ControlCommand& command) const;
  /// Has the module such a link, or connector?
  [[nodiscard]] Refusal CheckPart(bridge::ControlKind kind, const bridge::ControlPart& part) const;
  /// Is there such an image, and can the robot run it?
  Refusal CheckImage(const bridge::ControlCommand& command);

  const model::Model& model_;
  const model::Robot& robot_;
  int root_ = 0;
  RunImages& images_;
  ModuleStates states_;
};

}  // namespace morphbus::tools
