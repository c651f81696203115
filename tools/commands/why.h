#pragma once
// The explanation that `connections --why` prints.

#include <string>

#include "compiler/m3l/compile.h"
#include "tools/base/json.h"

namespace morphbus::tools {

/// Explains on stdout why two connectors mate as they do under connection number `connection` of
/// the compiled model: every candidate, and what removed it, underlined in the source.
/// @param compiled     a model that may have errors, but not in this connection (`explainable`).
/// @param connection   index into Model::connection_types of `compiled.solved`.
/// @param connector_a  index of the connector in the module type of member a; `connector_b` in b's.
void PrintWhy(const m3l::CompileOutput& compiled, size_t connection, int connector_a,
              int connector_b);

/// The same as JSON: `{"connection":…,"a":…,"b":…,"failures":[…],"free":…,"candidates":[…]}`.
/// Poses are X_AB, the pose of member b in member a (metres).
Json WhyJson(const m3l::CompileOutput& compiled, size_t connection, int connector_a,
             int connector_b);

}  // namespace morphbus::tools
