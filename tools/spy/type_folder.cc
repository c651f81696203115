#include "tools/spy/type_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "tools/base/files.h"
#include "tools/spy/lcm_sources.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

/// Bounds on what somebody may name by mistake, such as the root of a disk.
constexpr size_t kMostFiles = 10'000;
constexpr size_t kLargestFile = size_t{4} << 20;
constexpr int kDeepestFolder = 16;

/// The .lcm files below a folder, in order of name. Links to folders are not followed, so that none
/// leads round in a circle.
Result<std::vector<std::string>> FilesBelow(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code error;
  fs::recursive_directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (it.depth() >= kDeepestFolder) it.disable_recursion_pending();
    // A file that cannot be looked at is passed over, as no type of it was asked for.
    std::error_code unreadable;
    if (it->path().extension() != ".lcm" || !it->is_regular_file(unreadable)) continue;
    files.push_back(it->path().string());
    if (files.size() > kMostFiles) {
      return Fail(fmt::format("--types {}: more than {} .lcm files", folder, kMostFiles));
    }
  }
  if (error) return Fail(fmt::format("--types {}: {}", folder, error.message()));
  if (files.empty()) return Fail(fmt::format("--types {}: no .lcm file in it", folder));
  std::sort(files.begin(), files.end());
  return files;
}

/// All files that the paths name.
Result<std::vector<LcmFile>> ReadTypeFolders(const std::vector<std::string>& paths) {
  std::vector<LcmFile> files;
  for (const std::string& path : paths) {
    std::error_code error;
    // A path is a file, or a folder with all that is below it.
    std::vector<std::string> names = {path};
    if (fs::is_directory(path, error)) {
      Result<std::vector<std::string>> below = FilesBelow(path);
      if (!below) return Fail(below.error().message);
      names = std::move(*below);
    }
    for (const std::string& name : names) {
      Result<std::string> text = ReadFile(name, kLargestFile);
      if (!text) return Fail("--types: " + text.error().message);
      files.push_back({name, std::move(*text)});
    }
  }
  return files;
}

}  // namespace

Result<LcmSchema> ReadSchema(const std::vector<std::string>& paths,
                             std::vector<std::string>* warnings) {
  Result<std::vector<LcmFile>> files = ReadTypeFolders(paths);
  if (!files) return Fail(files.error().message);
  // Ours come first: a file that defines one of them otherwise does not hide it.
  files->insert(files->begin(), {"morphbus's own types", LcmSources()});
  return LcmSchema::ParseFiles(*files, warnings);
}

}  // namespace morphbus::tools
