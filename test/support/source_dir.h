#pragma once
// Where the source tree is. The path is compiled into one file alone, so that all other test
// sources are the same in every checkout and a compiler cache serves them all.

#include <string>

namespace morphbus::test {

/// The absolute path of a file or folder of the source tree, e.g. of "models/mtran.m3l".
std::string SourcePath(const std::string& path);

}  // namespace morphbus::test
