#include "tools/launch/run_record.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace morphbus::tools {

Result<RunRecord> RunRecord::InMemory() {
  const int fd = memfd_create("morphbus-run", MFD_CLOEXEC);
  if (fd < 0) return Fail(std::string("cannot record a run in memory: ") + std::strerror(errno));
  RunRecord record("/proc/self/fd/" + std::to_string(fd));
  record.fd_ = fd;
  return record;
}

RunRecord::RunRecord(RunRecord&& other) noexcept
    : path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

RunRecord::~RunRecord() {
  if (fd_ >= 0) close(fd_);
}

}  // namespace morphbus::tools
