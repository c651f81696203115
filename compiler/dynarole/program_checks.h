#pragma once
// What can be said of a program only as a whole, once the types in it are known. Each function
// reports what is wrong in the final pass.

#include "compiler/dynarole/check_pass.h"
#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {

/// Concrete roles, which modules play, give all their fields a value, and every field has a type
/// that some value tells.
void CheckFieldsSet(const ProgramModel& model, CheckPass* pass);
/// Every parameter has a type that something tells, and commands take only what means the
/// same to other modules.
void CheckSignatures(const ProgramModel& model, CheckPass* pass);
/// Calls must end and fit the VM's fixed stack of frames, whichever role is played; requirements
/// and labels call nothing that acts. Routines get the effect of all that they may call.
void CheckCalls(ProgramModel* model, CheckPass* pass);

}  // namespace morphbus::dynarole
