#pragma once
// What a port needs of the emulated boards: a UART and a clock. The microbit (nRF51, Cortex-M0), or
// one of the MPS2 boards (Cortex-M3, M4).

#include <cstdint>

namespace morphbus::test {

inline volatile uint32_t& Register(uintptr_t at) {
  return *reinterpret_cast<volatile uint32_t*>(at);
}

#ifdef __ARM_ARCH_6M__
/// The UART of Nordic's nRF51.
class Uart {
 public:
  void Start() {
    Register(kBase + 0x500) = 4;
    Register(kBase + 0x000) = 1;
    Register(kBase + 0x008) = 1;
  }
  static bool Get(uint8_t* byte) {
    if (Register(kBase + 0x108) == 0) return false;
    Register(kBase + 0x108) = 0;
    *byte = static_cast<uint8_t>(Register(kBase + 0x518));
    return true;
  }
  static void Put(uint8_t byte) {
    Register(kBase + 0x11c) = 0;
    Register(kBase + 0x51c) = byte;
    while (Register(kBase + 0x11c) == 0) {
    }
  }

 private:
  static constexpr uintptr_t kBase = 0x40002000;
};
inline constexpr uint32_t kClockMhz = 16;
#else
/// The UART of ARM's Cortex-M System Design Kit.
class Uart {
 public:
  static void Start() {
    Register(kBase + 0x10) = 16;
    Register(kBase + 0x08) = 3;
  }
  static bool Get(uint8_t* byte) {
    if ((Register(kBase + 0x04) & 2) == 0) return false;
    *byte = static_cast<uint8_t>(Register(kBase));
    return true;
  }
  static void Put(uint8_t byte) {
    while ((Register(kBase + 0x04) & 1) != 0) {
    }
    Register(kBase) = byte;
  }

 private:
  static constexpr uintptr_t kBase = 0x40004000;
};
inline constexpr uint32_t kClockMhz = 25;
#endif

/// The emulator's line moves on by a byte while the processor does not ask for it.
inline void LetLineMoveOn() {
  for (int i = 0; i < 2000; ++i) __asm__ volatile("nop");
}

/// SysTick as a clock of microseconds since Start().
class SysTick {
 public:
  static void Start() {
    Register(kBase + 4) = kMask;
    Register(kBase + 8) = 0;
    Register(kBase) = 5;
  }
  /// To be called several times a second, before the counter has gone round.
  int64_t Microseconds() {
    const uint32_t now = Register(kBase + 8);
    // It counts down.
    cycles_ += (last_ - now) & kMask;
    last_ = now;
    us_ += cycles_ / kClockMhz;
    cycles_ %= kClockMhz;
    return us_;
  }

 private:
  static constexpr uintptr_t kBase = 0xe000e010;
  static constexpr uint32_t kMask = 0xffffff;
  uint32_t last_ = kMask, cycles_ = 0;
  int64_t us_ = 0;
};

}  // namespace morphbus::test
