#pragma once
// Puts a program's model and code into the bytes of an image (vm/image/image.h).

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/dynarole/codegen.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/source_text.h"

namespace morphbus::dynarole {

/// The image: header, strings, keywords, constants, functions, roles and code, one section after
/// the other, with its size and hash filled in. It is empty if it would be larger than
/// vm::kMaxImageBytes.
/// @param sources   the program's files. The first one is named by the last component of its path,
///                  imported ones from its folder, so that equal programs give equal images
///                  wherever they lie.
/// @param keywords  the table that ProgramModel::keywords counts in.
std::vector<uint8_t> WriteImage(const source::SourceSet& sources,
                                const keywords::KeywordTable& keywords, const ProgramModel& model,
                                const ProgramCode& code);

}  // namespace morphbus::dynarole
