#pragma once
// The answers of `morphbus roles`, for people and as JSON (docs/cli.md).

#include <optional>
#include <string>
#include <vector>

#include "tools/base/json.h"
#include "tools/base/model_io.h"
#include "tools/roles/role_explanation.h"
#include "tools/roles/static_roles.h"

namespace morphbus::tools {

/// Roles by module, all problems in one list, and the roles that no module plays.
Json RolesJson(const StaticRoles& roles);
/// The same as a table on stdout, then the problems with carets in the model and in the program.
/// @param source  where the model is written.
void PrintRoles(const RunPlan& plan, const StaticRoles& roles, ModelSource source);

/// A program on a robot; without roles if it does not compile against the model.
struct Recognized {
  std::string program, robot;
  std::optional<StaticRoles> roles;
};
/// How well a program fits a robot: every module takes a role and none has a problem; some take
/// one; none does.
enum class Fit { kNone, kSome, kAll };
Fit FitOf(const Recognized& one);
/// A list of answers, and by program the roles that no module of any of the robots takes.
Json RecognizedJson(const std::vector<Recognized>& found);
void PrintRecognized(const std::vector<Recognized>& found);

/// One role's explanation as an object; of several, the module with the role that it holds and a
/// list of theirs.
Json ExplanationsJson(const std::vector<RoleExplanation>& roles);
/// Each label and requirement of a role with its line of the program and what was measured; of
/// several roles only what fails.
void PrintExplanations(const RunPlan& plan, const std::vector<RoleExplanation>& roles,
                       ModelSource source);

}  // namespace morphbus::tools
