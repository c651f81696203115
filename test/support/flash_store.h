#pragma once
// The two places of a package store as flash has them, for tests: a place is wiped as a whole, and
// then each byte of it can be written once, in order.

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "vm/limits.h"
#include "vm/spread/package_store.h"

namespace morphbus::test {

class FlashStore final : public vm::PackageStore {
 public:
  [[nodiscard]] uint32_t capacity() const override { return capacity_; }
  bool Write(int place, uint32_t offset, const uint8_t* bytes, uint32_t size) override {
    std::vector<uint8_t>& flash = places_[place];
    if (offset == 0) flash.clear();
    EXPECT_EQ(offset, flash.size()) << "written out of order";
    EXPECT_GT(size, 0u);
    EXPECT_LE(offset + size, capacity_);
    // What is read must not move, as programs run there.
    flash.reserve(capacity_);
    flash.insert(flash.end(), bytes, bytes + size);
    finished_[place] = false;
    ++written_;
    return flash.size() < worn_out_at_;
  }
  bool Finish(int place) override { return finished_[place] = true; }
  [[nodiscard]] const uint8_t* Read(int place) const override {
    EXPECT_TRUE(finished_[place]) << "read before it was whole";
    return places_[place].data();
  }

  void SetCapacity(uint32_t capacity) { capacity_ = capacity; }
  /// The byte behind this many fails to be kept.
  void SetWornOutAt(size_t size) { worn_out_at_ = size; }
  /// How often it was written to.
  [[nodiscard]] int written() const { return written_; }

 private:
  uint32_t capacity_ = vm::kMaxPackageBytes;
  size_t worn_out_at_ = ~size_t{0};
  int written_ = 0;
  bool finished_[2] = {};
  std::vector<uint8_t> places_[2];
};

}  // namespace morphbus::test
