#pragma once
// The canonical layout of DynaRole text (docs/dynarole.md, layout).

#include <optional>
#include <string>

#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// A file in canonical layout: a statement a line, blocks indented by two spaces, lines of at most
/// 100 columns. It has the same tokens and comments in the same order, so that the compiled image
/// does not change; formatting the result again changes nothing. Nothing, with errors in
/// `diagnostics`, if the text does not parse.
/// @param file  index of the file in `sources`.
std::optional<std::string> Format(const source::SourceSet& sources, int file,
                                  source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
