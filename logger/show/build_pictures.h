#pragma once
// The pictures of a sheet for putting a robot together.

#include <span>

#include "compiler/model/assembly_plan.h"
#include "logger/show/build_words.h"
#include "logger/show/sheet.h"

namespace morphbus::logger {

/// A module of a type, all joints at 0, from two opposite corners: its connectors with their names,
/// each where it is seen. The module frame is the world's.
SheetPicture TypePicture(const model::Model& model, int type);

/// Modules that are put on in one step, drawn off from where they go, in colour among the pale ones
/// that stand already. Connectors that mate have dots with numbers from `first_mark` on, two of one
/// colour with a line between them: the standing one, then the own. `added` is part of the plan's
/// row of modules; those before it stand. Of many only the nearest are drawn.
SheetPicture StepPicture(const Assembly& assembly, std::span<const model::AddedModule> added,
                         int first_mark);

/// The whole robot with its links at X_RL, a colour a module; `words` say which pose it is.
SheetPicture PosePicture(const Assembly& assembly,
                         const std::vector<std::vector<model::Pose>>& X_RL, std::string words);

}  // namespace morphbus::logger
