#pragma once
// What the compilers found, as their libraries tell it.

#include <morphbus/diagnostic.h>

#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus {

/// Throws TextError where there are errors. Else gives the warnings to `warnings`, if that is not
/// null, in place of what is there.
void ThrowOnErrors(const source::Diagnostics& diagnostics, const source::SourceSet& sources,
                   std::vector<Diagnostic>* warnings);

/// What Format of a language makes of a text; throws TextError where that does not parse.
std::string FormatOrThrow(const std::string& name, const std::string& text,
                          std::optional<std::string> (*format)(const source::SourceSet& sources,
                                                               int file,
                                                               source::Diagnostics* diagnostics));

}  // namespace morphbus
