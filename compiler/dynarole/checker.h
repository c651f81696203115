#pragma once
// Types and meanings. Parameters, abstract fields and results have no written types; they are found
// by checking everything again, silently, until nothing changes, and then once aloud.

#include "compiler/dynarole/program_model.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// Finds the types and meanings of all expressions and statements and writes them into the tree and
/// the model, until a pass over the program finds nothing new. What does not fit is an error in
/// `diagnostics`; a program without errors can be translated by Generate.
/// @param keywords  the words for parts of the module types that the program is compiled for.
/// @param model     what BuildModel made; gets types, effects, locals, calls and keywords used.
void Check(const keywords::KeywordTable& keywords, ProgramModel* model,
           source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
