#pragma once
// A module's last snapshot in a shared mapping: it survives the process, whatever kills it, but not
// the machine, since nothing waits for the disk.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Two slots, written in turn; the number that says which one holds comes last. A process killed in
/// the middle of Write leaves the one before.
class SnapshotFile {
 public:
  /// Largest snapshot that fits, bytes.
  static constexpr size_t kSlotBytes = 1u << 20;

  /// Opens the file, creating it empty if need be.
  /// Fails in one sentence that names the file and the system's reason.
  static Result<std::unique_ptr<SnapshotFile>> Open(const std::string& path);
  SnapshotFile(const SnapshotFile&) = delete;
  SnapshotFile& operator=(const SnapshotFile&) = delete;
  ~SnapshotFile();

  /// Makes this the newest snapshot, of at most kSlotBytes bytes. Costs a copy and no system call.
  void Write(const std::vector<uint8_t>& snapshot);
  /// The newest snapshot written whole; empty if there is none.
  [[nodiscard]] std::vector<uint8_t> Read() const;

 private:
  /// Takes the mapping over and unmaps it in the end.
  explicit SnapshotFile(uint8_t* mapping) : mapping_(mapping) {}

  /// The file in memory, head first.
  uint8_t* mapping_;
};

}  // namespace morphbus::bridge
