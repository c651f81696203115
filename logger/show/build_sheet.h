#pragma once
// The sheet with which a person puts a real robot together: what is needed, the steps as pictures,
// and poses to check it in.

#include <span>
#include <vector>

#include "compiler/solver/check_poses.h"
#include "logger/show/build_words.h"
#include "logger/show/sheet.h"

namespace morphbus::logger {

/// So many steps have a picture at most; a robot of more modules has several in a step.
inline constexpr int kMostBuildSteps = 60;
/// The most modules of a robot that a sheet is made for.
inline constexpr size_t kMostBuildModules = 1000;

/// The plan's row of modules, cut into steps: one a module, or as few more as keep to
/// kMostBuildSteps.
std::vector<std::span<const model::AddedModule>> StepsOf(const model::AssemblyPlan& plan);

/// Makes the sheet; its pictures are drawn when it is written.
Sheet BuildSheet(const Assembly& assembly, const solver::CheckPoses& poses);

}  // namespace morphbus::logger
