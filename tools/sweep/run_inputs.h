#pragma once
// What a run of a sweep may be told, by name: the options of `morphbus run` that decide how a run
// goes. One table says how each is read, put into the options, and written on a command line.

#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "tools/base/json.h"
#include "tools/plan/run_plan.h"

namespace morphbus::tools {

/// In a sweep over variants (`morphbus variants`) the names under which a point has the assembly
/// that runs, `robot` being the robot that it is a variant of, and how many variants there are.
inline constexpr const char* kVariant = "variant";
inline constexpr const char* kVariants = "variants";

/// The values of one run by the names of its inputs: truths, numbers and texts. Those of settings
/// stand under the setting's own name, or under "set." and that name where an input or a group of
/// figures has it, too.
using RunPoint = Json;

/// One input.
struct RunInput {
  enum class Kind { kFile, kText, kNumber, kSeconds, kFraction, kWhole, kTruth };
  std::string_view name;
  /// Another name, for several values.
  std::string_view plural;
  Kind kind;
  /// Its option of `morphbus run`; empty for a positional argument.
  std::string_view option;
  /// Puts a value of its kind into the options; a file's path is complete.
  void (*put)(const Json& value, RunOptions* options);
};

/// All of them, in the order in which a command line has them.
const std::vector<RunInput>& RunInputs();
/// The one of this name or plural; null if there is none.
const RunInput* FindInput(std::string_view name);

/// `value` as one of the input's kind: seconds and fractions may be texts with a unit. Fails,
/// saying what is expected, if it is none.
Result<Json> CheckedInput(const RunInput& input, const Json& value);

/// The name of the setting that a point has under `name`; empty if that is an input's or a
/// figure's.
std::string SettingName(std::string_view name);
/// Under which name a point has the setting `setting`.
std::string PointName(const std::string& setting);

/// The options of a run at `point`, whose paths are relative to `folder`. The variant
/// is left to the caller.
RunOptions OptionsOf(const RunPoint& point, const std::string& folder);

/// The command that does the same run alone, "morphbus run MODEL PROGRAM --robot … --inproc
/// --no-log", for a variant behind the one that writes it. Words are quoted for a shell where they
/// need it.
std::string RunCommand(const RunPoint& point, const std::string& folder);

/// A value as people read it in a command: 20.5, true, or the text itself.
std::string PlainText(const Json& value);
/// The word as a shell takes it, quoted if it has to be.
std::string ShellWord(const std::string& word);
/// "amplitude = 20, seed = 3".
std::string PointText(const RunPoint& point);

}  // namespace morphbus::tools
