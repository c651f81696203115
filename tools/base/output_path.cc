#include "tools/base/output_path.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "compiler/base/read_file.h"
#include "compiler/base/utf8.h"
#include "tools/base/messages.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // As many as the kernel follows.

// So many bytes of a file are looked at; every beginning of the table lies within them.
constexpr size_t kHeadSize = 256;

/// Whether a file whose first bytes are `head` is of the kind.
bool BeginsAs(const OutputKind& kind, std::string_view head) {
  return !(kind.binary && IsUtf8(head)) && head.starts_with(kind.starts) &&
         head.find(kind.has) != std::string_view::npos;
}

}  // namespace

Result<std::string> FollowLinks(const std::string& path) {
  fs::path at(path);
  for (int links = 0; links < kMostLinks; ++links) {
    std::error_code error;
    // A name of a stream is not followed: it is a link to the file behind the stream.
    if (OwnDescriptor(at.string()) || !fs::is_symlink(fs::symlink_status(at, error))) {
      return at.string();
    }
    // The target may be a link again, and relative to the folder that the link lies in.
    const fs::path target = fs::read_symlink(at, error);
    if (error) return Fail(fmt::format("cannot read the link {}: {}", path, error.message()));
    at = target.is_absolute() ? target : at.parent_path() / target;
  }
  // So many links can only be a circle.
  return Fail(fmt::format("cannot write {}: {}", path, std::strerror(ELOOP)));
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
  // What is there and is neither a file nor a folder is a pipe, a device or a socket.
  return OwnDescriptor(*target) ||
         (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status));
}

bool IsOneOf(const std::string& output, const std::vector<std::string>& inputs) {
  if (output == "-") return false;
  // Files are compared by device and inode, which see through links and spellings.
  for (const std::string& input : inputs) {
    std::error_code error;
    if (fs::equivalent(output, input, error) && !error) return true;
  }
  return false;
}

Result<void> CheckOutput(const std::string& path, const OutputKind& kind, bool force,
                         const std::vector<std::string>& inputs) {
  if (IsOneOf(path, inputs)) {
    return Fail(fmt::format("cannot write {}: this command reads that file; name another", path));
  }
  std::error_code error;
  // These outputs replace nothing, or the user has allowed it.
  if (force || path.empty() || IsStream(path) || !fs::is_regular_file(path, error)) return {};
  // Something is there: its first bytes say what it is.
  std::ifstream file(path, std::ios::binary);
  std::string head(kHeadSize, '\0');
  file.read(head.data(), kHeadSize);
  head.resize(static_cast<size_t>(file.gcount()));
  // What cannot be read cannot be known to be replaceable.
  if (!file.bad() && (fs::file_size(path, error) == 0 || BeginsAs(kind, head))) return {};
  return Fail(fmt::format(
      "cannot write {}: a file that is not {} is there; name another, or replace it with --force",
      path, kind.name));
}

bool MayWrite(const std::string& path, const OutputKind& kind, bool force,
              const std::vector<std::string>& inputs) {
  const Result<void> checked = CheckOutput(path, kind, force, inputs);
  if (!checked) Unusable(checked.error().message);
  return checked.has_value();
}

bool MayWriteLog(const std::string& path, bool force, const std::vector<std::string>& inputs) {
  // A log is renamed to its final name when it is closed.
  return MayWrite(path, outputs::kLog, force, inputs) &&
         MayWrite(path + ".partial", outputs::kLog, force, inputs);
}

}  // namespace morphbus::tools
