#pragma once
// Models and programs from their sources, for tests; what does not compile fails at once.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::test {

/// The model in a file of the source tree, e.g. "models/mtran.m3l".
model::Model ModelFrom(const std::string& path);

/// The text of a file of the source tree.
std::string TextOf(const std::string& path);

/// A program's image; aborts with the diagnostics if it does not compile.
std::vector<uint8_t> ProgramFrom(const std::string& text, const model::Model& model);

}  // namespace morphbus::test
