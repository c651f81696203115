#pragma once
// Warnings about what a program can do without.

#include "compiler/dynarole/program_model.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// Warnings about a program without errors: what is never used, can never be reached, or never
/// holds.
void Lint(const keywords::KeywordTable& keywords, const ProgramModel& model,
          source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
