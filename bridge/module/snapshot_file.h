#pragma once
// A module's last snapshot in a shared mapping: it survives the process, whatever kills it, but not
// the machine, since nothing waits for the disk.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Two slots, written in turn; the number that says which one holds comes last. A process killed in
/// the middle of Write leaves the one before.
class SnapshotFile {
 public:
  /// Largest snapshot that fits, bytes.
  static constexpr size_t kSlotBytes = 1u << 20;
  /// Room that each slot has from the start, and by which it grows: the quadruped's modules need
  /// some 20 kB. A file that had all of it would take the memory of a run of hundreds of modules.
  static constexpr size_t kRoomBytes = 24u << 10;

  /// Opens the file, creating it empty if need be, and makes sure of the first kRoomBytes of each
  /// slot. Fails in one sentence that names the file and the system's reason.
  static Result<std::unique_ptr<SnapshotFile>> Open(const std::string& path);
  SnapshotFile(const SnapshotFile&) = delete;
  SnapshotFile& operator=(const SnapshotFile&) = delete;
  ~SnapshotFile();

  /// Makes this the newest snapshot, of at most kSlotBytes bytes. Costs a copy, and no system call
  /// unless the slot must grow. Fails where there is no room for that; the snapshot before stays
  /// the newest then.
  Result<void> Write(const std::vector<uint8_t>& snapshot);
  /// The newest snapshot written whole; empty if there is none.
  [[nodiscard]] std::vector<uint8_t> Read() const;

 private:
  /// Takes the descriptor over and closes it in the end.
  SnapshotFile(std::string path, int fd) : path_(std::move(path)), fd_(fd) {}
  /// Gives the file its size, and maps it.
  Result<void> Map();
  /// Makes sure that the first `size` bytes of a slot have memory or disk behind them: a store into
  /// a page that finds none ends the process by SIGBUS.
  Result<void> MakeRoom(uint64_t slot, size_t size);

  std::string path_;
  int fd_;
  /// The file in memory, head first; null before it is mapped.
  uint8_t* mapping_ = nullptr;
  /// Bytes of each slot that are known to have room.
  size_t room_[2] = {0, 0};
};

}  // namespace morphbus::bridge
