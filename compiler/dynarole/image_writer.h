#pragma once
// Puts a program's model and code into the bytes of an image (vm/image.h).

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/dynarole/codegen.h"
#include "compiler/dynarole/keyword_table.h"

namespace morphbus::dynarole {

/// The image; empty if it would be larger than vm::kMaxImageBytes. `source_name` is shortened to
/// its last path component, so that equal programs give equal images wherever they lie.
std::vector<uint8_t> WriteImage(const std::string& source_name, const KeywordTable& keywords,
                                const ProgramModel& model, const ProgramCode& code);

}  // namespace morphbus::dynarole
