#pragma once
// The text of .lcm files to types, as lcm-gen reads them.

#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// True for the types that lcm-gen knows without a definition (lcmgen.c, primitive_types).
bool IsLcmPrimitive(const std::string& type);

/// The types of a text, in order; their fingerprints are not filled in yet. Fails with the line of
/// the first error: where lcm-gen stops, and on more than 4,096 members in a struct or 100,000 in
/// all.
Result<std::vector<LcmType>> ParseLcm(std::string_view text);

}  // namespace morphbus::tools
