#pragma once
// Settings of a run: other values for parameters of its program and for attributes of its model
// than stand in their sources (`run --set`, `--params`).

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "compiler/model/run_description.pb.h"
#include "tools/base/options.h"
#include "tools/base/program.h"

namespace morphbus::tools {

/// One setting, "NAME=VALUE".
struct Setting {
  /// Of a parameter: "swing", or with its role "Leg.swing". With two dots in it of an attribute of
  /// a module type: "MTRAN.joint_1.torque".
  std::string name;
  /// As it was written.
  std::string value;
  /// Where it stands, for messages: "--set swing=45", or file and line.
  std::string origin;

  /// Whether it is about the model.
  [[nodiscard]] bool OfModel() const;
};

/// Adds `--params`, the path of a file of settings, and `--set`, one or more of "NAME=VALUE".
void AddSettings(Subcommand* sub, std::string* params, std::vector<std::string>* set);

/// All settings, those of the file (none if its path is empty) before the others: of two for one
/// name the later one counts. Empty, after printing why, if one of them cannot be understood.
/// @param from  what stands before the words "params" and "set" in messages.
std::optional<std::vector<Setting>> ReadSettings(const std::string& params,
                                                 const std::vector<std::string>& set,
                                                 const std::string& from = "--");

/// Gives the program's parameters their values. Says what is wrong with a setting, and where it
/// came from; then the program is as it was.
bool SetParameters(const std::vector<Setting>& settings, CompiledProgram* program);

/// Gives the attributes of the model their values, and says so in the run's description. Says what
/// is wrong with a setting; the model is of no use then.
bool SetAttributes(const std::vector<Setting>& settings, model::Model* model,
                   proto::RunDescription* description);

}  // namespace morphbus::tools
