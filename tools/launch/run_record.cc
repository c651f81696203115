#include "tools/launch/run_record.h"

#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace morphbus::tools {

Result<RunRecord> RunRecord::InMemory() {
  Descriptor fd(memfd_create("morphbus-run", MFD_CLOEXEC));
  std::string path = "/proc/self/fd/" + std::to_string(fd.get());
  if (fd.get() >= 0) return RunRecord(std::move(path), std::move(fd));
  return Fail(std::string("cannot record a run in memory: ") + std::strerror(errno));
}

}  // namespace morphbus::tools
