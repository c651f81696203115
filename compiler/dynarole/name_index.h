#pragma once
// The names of a DynaRole program, for editors, as the checker has resolved them.

#include "compiler/dynarole/program_model.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/name_table.h"

namespace morphbus::dynarole {

/// Every name in a program and what it means, with the types that were found for what has none
/// written. Names that mean nothing are left out.
/// @param model  checked (checker.h), with or without errors.
source::NameTable IndexNames(const source::SourceSet& sources,
                             const keywords::KeywordTable& keywords, const ProgramModel& model);

}  // namespace morphbus::dynarole
