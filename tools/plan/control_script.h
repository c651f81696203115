#pragma once
// Commands that are known before a run begins, with their ticks (`run --commands`), and the images
// that they deploy.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/control/control_command.h"
#include "compiler/model/robot_model.h"

namespace morphbus::tools {

/// A command and the tick at which it takes effect, as CLOCK named it.
struct ScriptedCommand {
  int64_t tick = 0;
  bridge::ControlCommand command;
};

/// All commands of a file, in order of their ticks.
struct ControlScript {
  std::vector<ScriptedCommand> commands;
  std::map<uint64_t, std::string> images;  ///< Programs to deploy, by hash.
};

/// The commands of a text, lines of a tick and a command or what `info --json` lists; images are
/// not looked for. The error begins with the place, that is the line's number or a path into JSON.
Result<ControlScript> ParseScript(const std::string& text);

/// Adds a command behind all that are given at its tick or before.
void InsertInOrder(ScriptedCommand command, ControlScript* script);

/// Compiles a program for the robots of `model` and makes sure that they can run it: a verified
/// image whose keywords some module type has. Nothing, after printing what is wrong, if not.
std::optional<std::string> ImageFor(const model::Model& model, const std::string& program,
                                    uint64_t* hash);
/// Empty, or why no module type of the model could run this image.
std::string WhyNotFor(const model::Model& model, const std::string& image);

/// Reads lines "TICK COMMAND" (blank ones and comments after # left out), or what `info --json`
/// prints, and compiles what is deployed. Nothing, after printing file and line, if the file cannot
/// be used.
std::optional<ControlScript> LoadScript(const std::string& path, const model::Model& model);

/// Warns on stderr of commands that a run of `num_ticks` control ticks (-1: until stopped) ends
/// before.
void WarnOfUnreached(const ControlScript& script, int64_t num_ticks);

/// Puts a script into a run's folder, where the sim finds it, and back. No folder (an empty path)
/// and one without a script give an empty script; reading fails if there is one that cannot be
/// used.
Result<void> WriteScript(const ControlScript& script, const std::string& folder);
Result<ControlScript> ReadScript(const std::string& folder);

/// Where a run's folder has the image of this hash that was given to it.
std::string ImagePath(const std::string& folder, uint64_t hash);

}  // namespace morphbus::tools
