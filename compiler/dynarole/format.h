#pragma once
// The canonical layout of DynaRole text (docs/dynarole.md, layout).

#include <optional>
#include <string>

#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// File `file` in canonical layout: the same tokens and comments, in order; formatting the result
/// again changes nothing. Nothing, with errors in `diagnostics`, if the text does not parse.
std::optional<std::string> Format(const source::SourceSet& sources, int file,
                                  source::Diagnostics& diagnostics);

}  // namespace morphbus::dynarole
