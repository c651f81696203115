#include "tools/launch/run_record.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "tools/base/messages.h"
#include "tools/base/output_path.h"

namespace morphbus::tools {
namespace {

/// Why the log cannot be written; empty if it can. Found out before anything starts: the logger
/// itself would find out when the others wait for it.
std::string WhyNoLog(const std::string& log) {
  if (std::filesystem::path(log).filename() == "-") {
    return "a log is a file, which is read again when the run ends: give it a name";
  }
  const std::string folder = std::filesystem::path(log).parent_path();
  // Both rights are needed to make a file in a folder and to rename it there.
  if (access(folder.c_str(), W_OK | X_OK) != 0) return std::strerror(errno);
  // What the log is called in the end, and while it is written.
  for (const std::string& path : {log, log + ".partial"}) {
    std::error_code unknown;
    const std::filesystem::file_status status = std::filesystem::status(path, unknown);
    if (unknown == std::errc::filename_too_long) {
      return fmt::format("its name is too long for {}, as it is called while it is written",
                         std::filesystem::path(log + ".partial").filename().string());
    }
    if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
      return path + (std::filesystem::is_directory(status) ? " is a folder" : " is no file") +
             "; --log takes the name of a file";
    }
  }
  return "";
}

}  // namespace

Result<RunRecord> RunRecord::InMemory() {
  Descriptor fd(memfd_create("morphbus-run", MFD_CLOEXEC));
  std::string path = "/proc/self/fd/" + std::to_string(fd.get());
  if (fd.get() >= 0) return RunRecord(std::move(path), std::move(fd));
  return Fail(std::string("cannot record a run in memory: ") + std::strerror(errno));
}

std::optional<RunRecord> RunRecord::ToLog(const std::string& path, bool force,
                                          const std::vector<std::string>& inputs) {
  if (const std::string why = WhyNoLog(path); !why.empty()) {
    return Refuse(fmt::format("cannot write {}: {}", path, why));
  }
  if (!MayWriteLog(path, force, inputs)) return std::nullopt;
  return RunRecord(path);
}

}  // namespace morphbus::tools
