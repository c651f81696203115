#include "tools/output_path.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // As many as the kernel follows.

}  // namespace

Result<std::string> FollowLinks(const std::string& path) {
  fs::path at(path);
  for (int links = 0; links < kMostLinks; ++links) {
    std::error_code error;
    if (OwnDescriptor(at.string()) || !fs::is_symlink(fs::symlink_status(at, error))) {
      return at.string();
    }
    const fs::path target = fs::read_symlink(at, error);
    if (error) return Fail(fmt::format("cannot read the link {}: {}", path, error.message()));
    at = target.is_absolute() ? target : at.parent_path() / target;
  }
  return Fail(fmt::format("cannot write {}: {}", path, std::strerror(ELOOP)));
}

std::optional<int> OwnDescriptor(const std::string& path) {
  const std::string plain = fs::path(path).lexically_normal().string();
  if (plain == "/dev/stdout") return STDOUT_FILENO;
  if (plain == "/dev/stderr") return STDERR_FILENO;
  for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!plain.starts_with(folder)) continue;
    int number = 0;
    const char* end = plain.data() + plain.size();
    const auto read = std::from_chars(plain.data() + folder.size(), end, number);
    if (read.ec == std::errc() && read.ptr == end && number >= 0) return number;
  }
  return std::nullopt;
}

bool IsStdout(const std::string& path) {
  return path == "-" || OwnDescriptor(path) == STDOUT_FILENO;
}

bool IsStream(const std::string& path) {
  if (path == "-") return true;
  const Result<std::string> target = FollowLinks(path);
  if (!target) return false;
  std::error_code error;
  const fs::file_status status = fs::status(*target, error);
  return OwnDescriptor(*target) ||
         (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status));
}

bool IsOneOf(const std::string& output, const std::vector<std::string>& inputs) {
  if (output == "-") return false;
  for (const std::string& input : inputs) {
    std::error_code error;
    if (fs::equivalent(output, input, error) && !error) return true;
  }
  return false;
}

}  // namespace morphbus::tools
