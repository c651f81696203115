#pragma once
// From the keywords that the M3L compiler exports to those that the DynaRole compiler knows.

#include <string>
#include <vector>

#include "compiler/dynarole/compile.h"
#include "compiler/dynarole/keyword_table.h"
#include "compiler/emit/keywords.h"

namespace morphbus::dynarole {

/// One table of all the module types' keywords; at most 64 types.
KeywordTable KeywordTableOf(const std::vector<emit::ModuleKeywords>& types);

/// CompileProgram with the keywords of these module types.
CompileResult CompileProgram(const std::string& name, const std::string& text,
                             const std::vector<emit::ModuleKeywords>& types,
                             Dump dump = Dump::kNone);

}  // namespace morphbus::dynarole
