#pragma once
// The explanation that `connections --why` prints.

#include <string>

#include "tools/cli.h"

namespace morphbus::tools {

/// Explains on stdout why two connectors mate as they do under connection number `connection` of
/// the compiled model: every candidate, and what removed it, underlined in the source.
void PrintWhy(const m3l::CompileOutput& compiled, size_t connection, int connector_a,
              int connector_b);

/// The same as JSON: `{"connection":…,"a":…,"b":…,"failures":[…],"free":…,"candidates":[…]}`.
Json WhyJson(const m3l::CompileOutput& compiled, size_t connection, int connector_a,
             int connector_b);

}  // namespace morphbus::tools
