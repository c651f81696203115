#include "tools/base/share_folder.h"

#include <filesystem>

namespace morphbus::tools {

std::string ShareFolder(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  // The running file tells where it is installed, however it was called.
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return (program.parent_path().parent_path() / "share/morphbus" / name).string();
}

}  // namespace morphbus::tools
