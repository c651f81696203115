#pragma once
// The values that a shell offers where a command line wants names: robots, modules, roles, runs.

#include <string>

#include "tools/shell/completion.h"

namespace morphbus::tools {

/// A ValueFinder. Models, programs and logs are those that the
/// line names; where it names none, those of the run that it names, or of the only one that goes on
/// here. Nothing for a type that has no such words, and where what the line names cannot be used,
/// which stderr says.
TypeValues ValuesOfType(const std::string& type, const TypedLine& line);

}  // namespace morphbus::tools
