#include "test/support/source_dir.h"

namespace morphbus::test {

std::string SourcePath(const std::string& path) { return MORPHBUS_SOURCE_DIR "/" + path; }

}  // namespace morphbus::test
