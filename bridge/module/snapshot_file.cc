#include "bridge/module/snapshot_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
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

/// Where a slot begins in the file.
size_t OffsetOf(uint64_t slot) { return kHeadBytes + slot * SnapshotFile::kSlotBytes; }

}  // namespace

Result<std::unique_ptr<SnapshotFile>> SnapshotFile::Open(const std::string& path) {
  // The file outlives the process: the kernel keeps what was stored in the mapping.
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return Fail("cannot open " + path + ": " + std::strerror(errno));
  std::unique_ptr<SnapshotFile> file(new SnapshotFile(path, fd));
  Result<void> ready = file->Map();
  for (uint64_t slot = 0; slot < 2; ++slot) {
    if (ready) ready = file->MakeRoom(slot, kRoomBytes);
  }
  if (!ready) return tl::unexpected(ready.error());
  return file;
}

Result<void> SnapshotFile::Map() {
  struct stat status = {};
  // Sparse: only what is made room for costs memory or disk.
  if (fstat(fd_, &status) != 0 ||
      (status.st_size != static_cast<off_t>(kMappingBytes) && ftruncate(fd_, kMappingBytes) != 0)) {
    return Fail("cannot size " + path_ + ": " + std::strerror(errno));
  }
  void* mapping = mmap(nullptr, kMappingBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0);
  if (mapping == MAP_FAILED) return Fail("cannot map " + path_ + ": " + std::strerror(errno));
  mapping_ = static_cast<uint8_t*>(mapping);
  return {};
}

SnapshotFile::~SnapshotFile() {
  if (mapping_ != nullptr) munmap(mapping_, kMappingBytes);
  close(fd_);
}

Result<void> SnapshotFile::MakeRoom(uint64_t slot, size_t size) {
  if (size <= room_[slot]) return {};
  // In steps, so that a state that grows slowly does not ask in every tick. The head lies before
  // the first slot, and gets its room with it.
  const size_t wanted = std::min(kSlotBytes, (size + kRoomBytes - 1) / kRoomBytes * kRoomBytes);
  const size_t begin = slot == 0 ? 0 : OffsetOf(slot);
  const size_t end = OffsetOf(slot) + wanted;
  // Where the file system has no such call, glibc writes to every block instead.
  int error = 0;
  do {
    error = posix_fallocate(fd_, static_cast<off_t>(begin), static_cast<off_t>(end - begin));
  } while (error == EINTR);
  if (error != 0) {
    return Fail("no room for " + std::to_string(end - begin) + " bytes of " + path_ + ": " +
                std::strerror(error));
  }
  room_[slot] = wanted;
  return {};
}

Result<void> SnapshotFile::Write(const std::vector<uint8_t>& snapshot) {
  MORPHBUS_CHECK(snapshot.size() <= kSlotBytes);
  auto* head = reinterpret_cast<Head*>(mapping_);
  // The slot that does not hold is written, then the count makes it the one that does.
  const uint64_t next = head->count + 1;
  if (Result<void> room = MakeRoom(next % 2, snapshot.size()); !room) return room;
  std::memcpy(mapping_ + OffsetOf(next % 2), snapshot.data(), snapshot.size());
  head->sizes[next % 2] = snapshot.size();
  // The processor may be interrupted for good between any two stores; they must land in this order.
  std::atomic_ref<uint64_t>(head->count).store(next, std::memory_order_release);
  return {};
}

std::vector<uint8_t> SnapshotFile::Read() const {
  const auto* head = reinterpret_cast<const Head*>(mapping_);
  // Nothing written yet, or a size that cannot be: then there is nothing to go on from.
  const uint64_t count = head->count;
  if (count == 0 || head->sizes[count % 2] > kSlotBytes) return {};
  const uint8_t* slot = mapping_ + OffsetOf(count % 2);
  return {slot, slot + head->sizes[count % 2]};
}

}  // namespace morphbus::bridge
