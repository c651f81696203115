#include "bridge/module/snapshot_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

/// First bytes of the mapping. All zero: nothing written yet.
struct Head {
  uint64_t count;     ///< Snapshots written; slot count % 2 holds.
  uint64_t sizes[2];  ///< Bytes in each slot.
};

// The head has a cache line of its own; the two slots follow it.
constexpr size_t kHeadBytes = 64;
constexpr size_t kMappingBytes = kHeadBytes + 2 * SnapshotFile::kSlotBytes;

}  // namespace

Result<std::unique_ptr<SnapshotFile>> SnapshotFile::Open(const std::string& path) {
  // The file outlives the process: the kernel keeps what was stored in the mapping.
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return Fail("cannot open " + path + ": " + std::strerror(errno));
  struct stat status = {};
  // Sparse: only pages that are written cost memory or disk.
  if (fstat(fd, &status) != 0 ||
      (status.st_size != static_cast<off_t>(kMappingBytes) && ftruncate(fd, kMappingBytes) != 0)) {
    const int error = errno;
    close(fd);
    return Fail("cannot size " + path + ": " + std::strerror(error));
  }
  void* mapping = mmap(nullptr, kMappingBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  const int error = errno;
  close(fd);
  if (mapping == MAP_FAILED) return Fail("cannot map " + path + ": " + std::strerror(error));
  return std::unique_ptr<SnapshotFile>(new SnapshotFile(static_cast<uint8_t*>(mapping)));
}

SnapshotFile::~SnapshotFile() { munmap(mapping_, kMappingBytes); }

void SnapshotFile::Write(const std::vector<uint8_t>& snapshot) {
  MORPHBUS_CHECK(snapshot.size() <= kSlotBytes);
  auto* head = reinterpret_cast<Head*>(mapping_);
  // The slot that does not hold is written, then the count makes it the one that does.
  const uint64_t next = head->count + 1;
  std::memcpy(mapping_ + kHeadBytes + (next % 2) * kSlotBytes, snapshot.data(), snapshot.size());
  head->sizes[next % 2] = snapshot.size();
  // The processor may be interrupted for good between any two stores; they must land in this order.
  std::atomic_ref<uint64_t>(head->count).store(next, std::memory_order_release);
}

std::vector<uint8_t> SnapshotFile::Read() const {
  const auto* head = reinterpret_cast<const Head*>(mapping_);
  // Nothing written yet, or a size that cannot be: then there is nothing to go on from.
  const uint64_t count = head->count;
  if (count == 0 || head->sizes[count % 2] > kSlotBytes) return {};
  const uint8_t* slot = mapping_ + kHeadBytes + (count % 2) * kSlotBytes;
  return {slot, slot + head->sizes[count % 2]};
}

}  // namespace morphbus::bridge
