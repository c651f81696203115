#pragma once
// A module's last snapshot in a shared mapping: survives the process, whatever kills it.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/source/result.h"

namespace morphbus::bridge {

/// Two slots, written in turn; the number that says which one holds comes last. A process killed in
/// the middle of Write leaves the one before.
class SnapshotFile {
 public:
  /// Largest snapshot that fits, bytes.
  static constexpr size_t kSlotBytes = 1u << 20;

  /// Opens the file, creating it empty if need be.
  static Result<SnapshotFile> Open(const std::string& path);
  SnapshotFile(SnapshotFile&& other) noexcept;
  SnapshotFile& operator=(SnapshotFile&&) = delete;
  SnapshotFile(const SnapshotFile&) = delete;
  SnapshotFile& operator=(const SnapshotFile&) = delete;
  ~SnapshotFile();

  void Write(const std::vector<uint8_t>& snapshot);
  /// The newest snapshot written whole; empty if there is none.
  [[nodiscard]] std::vector<uint8_t> Read() const;

 private:
  explicit SnapshotFile(uint8_t* mapping) : mapping_(mapping) {}

  uint8_t* mapping_;
};

}  // namespace morphbus::bridge
