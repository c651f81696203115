#pragma once
// Types and meanings. Parameters, abstract fields and results have no written types; they are found
// by checking everything again, silently, until nothing changes, and then once aloud.

#include <string>
#include <vector>

#include "compiler/dynarole/keyword_table.h"
#include "compiler/dynarole/program_model.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// Checks the program and annotates its tree; after it, a program without errors can be translated.
void Check(const source::SourceSet& sources, const KeywordTable& keywords, ProgramModel* model,
           source::Diagnostics* diagnostics);

/// Warnings about a program without errors: what is never used, can never be reached, or never
/// holds (lints.cc).
void Lint(const KeywordTable& keywords, const ProgramModel& model,
          source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
