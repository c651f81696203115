#pragma once
// The canonical layout of M3L text (docs/m3l.md, layout).

#include <optional>
#include <string>

#include "compiler/source/diagnostics.h"

namespace morphbus::m3l {

/// File `file` in canonical layout: the same tokens and comments, in order; formatting the result
/// again changes nothing. Returns nothing, with errors in `diagnostics`, if the text does not
/// parse. Names and imports are not looked at.
std::optional<std::string> Format(const source::SourceSet& sources, int file,
                                  source::Diagnostics* diagnostics);

}  // namespace morphbus::m3l
