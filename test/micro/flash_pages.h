#pragma once
// Two places for packages in the flash of an emulated board (vm/spread/package_store.h). The
// microbit (nRF51, Cortex-M0) has flash that its NVM controller erases and writes. The MPS2 boards
// have none: a piece of their RAM that nothing else uses stands in, and is treated alike.

#include <cstdint>

#include "vm/spread/package_store.h"

namespace morphbus::test {

/// Places of some pages each. Nothing is kept back: a word can be written twice, with ones for the
/// bytes that come later.
class FlashPages final : public vm::PackageStore {
 public:
  [[nodiscard]] uint32_t capacity() const override { return kPlaceBytes; }
  bool Write(int place, uint32_t offset, const uint8_t* bytes, uint32_t size) override {
    const uintptr_t begin = Address(place);
    if (offset == 0) {
      for (uint32_t page = 0; page < kPlaceBytes; page += kPageBytes) Erase(begin + page);
    }
    for (uint32_t i = 0; i < size; ++i) {
      const uintptr_t at = begin + offset + i;
      const uint32_t shift = 8 * (at & 3);
      WriteWord(at & ~uintptr_t{3}, ~(0xffu << shift) | uint32_t{bytes[i]} << shift);
      if (*reinterpret_cast<const volatile uint8_t*>(at) != bytes[i]) return false;
    }
    return true;
  }
  [[nodiscard]] const uint8_t* Read(int place) const override {
    return reinterpret_cast<const uint8_t*>(Address(place));
  }

 private:
  static constexpr uint32_t kPlaceBytes = 4096, kPageBytes = 1024;
#ifdef __ARM_ARCH_6M__
  static constexpr uintptr_t kBegin = 0x38000;
  // Of the NVM controller: whether the last order is done, what is allowed, which page to erase.
  static volatile uint32_t& Ready() { return *reinterpret_cast<volatile uint32_t*>(0x4001e400); }
  static volatile uint32_t& Config() { return *reinterpret_cast<volatile uint32_t*>(0x4001e504); }
  static volatile uint32_t& ErasePage() {
    return *reinterpret_cast<volatile uint32_t*>(0x4001e508);
  }
  static void Allow(uint32_t what) {
    Config() = what;
    while ((Ready() & 1) == 0) {
    }
  }
  static void Erase(uintptr_t page) {
    Allow(2);
    ErasePage() = page;
    Allow(0);
  }
  static void WriteWord(uintptr_t at, uint32_t word) {
    Allow(1);
    *reinterpret_cast<volatile uint32_t*>(at) = word;
    Allow(0);
  }
#else
  static constexpr uintptr_t kBegin = 0x20200000;
  static void Erase(uintptr_t page) {
    for (uint32_t i = 0; i < kPageBytes; i += 4)
      *reinterpret_cast<volatile uint32_t*>(page + i) = ~0u;
  }
  /// Ones become zeros, never the other way.
  static void WriteWord(uintptr_t at, uint32_t word) {
    auto* flash = reinterpret_cast<volatile uint32_t*>(at);
    *flash = *flash & word;
  }
#endif
  static uintptr_t Address(int place) {
    return kBegin + static_cast<uint32_t>(place) * kPlaceBytes;
  }
};

}  // namespace morphbus::test
