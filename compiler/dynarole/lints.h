#pragma once
// Warnings about what a program can do without.

#include "compiler/dynarole/program_model.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// Warnings about a program without errors: what is never used, can never be reached, or never
/// holds. They change nothing in the image.
/// @param keywords  the words for parts of the module types that the program is compiled for.
/// @param model     what Check has given types and meanings.
void Lint(const keywords::KeywordTable& keywords, const ProgramModel& model,
          source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
