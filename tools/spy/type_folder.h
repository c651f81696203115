#pragma once
// The .lcm files that --types names.

#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "tools/spy/lcm_schema.h"

namespace morphbus::tools {

/// The types of this program (LcmSources) and of .lcm files: `paths` are files, or folders, which
/// are searched to a depth of 16 for files whose names end with .lcm, in order of name. Fails in
/// one sentence if a path cannot be read, a folder has none, there are more than 10,000, or one is
/// over 4 MiB; and with file and line if one cannot be parsed. What is left out is said in
/// `warnings`.
Result<LcmSchema> ReadSchema(const std::vector<std::string>& paths,
                             std::vector<std::string>* warnings);

}  // namespace morphbus::tools
