#pragma once
// Bytes of an image while it is written; how they are read is said in vm/image/image.h. Host side
// only: it uses the heap.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace morphbus::vm {

/// Grows byte by byte. Numbers are little-endian on every host, and cut to their size.
class ImageBytes {
 public:
  /// One byte, from a number or an enumerator.
  template <typename T>
  void U8(T value) {
    bytes_.push_back(static_cast<uint8_t>(value));
  }
  void U16(uint64_t value) { Little(value, 2); }
  void U32(uint64_t value) { Little(value, 4); }
  void U64(uint64_t value) { Little(value, 8); }
  /// What another one, a string or a list of bytes holds.
  template <typename Bytes>
  void Append(const Bytes& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  /// Overwrites `count` bytes with a number that could not be known when they were written.
  void Patch(size_t at, uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_[at++] = static_cast<uint8_t>(value >> (8 * i));
  }

  [[nodiscard]] const std::vector<uint8_t>& bytes() const { return bytes_; }
  [[nodiscard]] size_t size() const { return bytes_.size(); }

 private:
  void Little(uint64_t value, int count) {
    bytes_.resize(bytes_.size() + static_cast<size_t>(count));
    Patch(bytes_.size() - static_cast<size_t>(count), value, count);
  }

  std::vector<uint8_t> bytes_;
};

}  // namespace morphbus::vm
