#pragma once
// How deep a function's stack was, on an emulated board: what lies below it is painted before.

#include <cstdint>

extern "C" char __bss_end[];

namespace morphbus::test {

inline constexpr uint32_t kPaint = 0x5afec0de;
inline uint32_t* StackLimit() { return reinterpret_cast<uint32_t*>(__bss_end); }

/// Paints all that lies below the caller's frame.
__attribute__((noinline)) inline void PaintStack() {
  volatile uint32_t here = 0;
  // Not this function's own frame.
  const uintptr_t end = reinterpret_cast<uintptr_t>(&here) - 64;
  for (uint32_t* at = StackLimit(); reinterpret_cast<uintptr_t>(at) < end; ++at) *at = kPaint;
}

/// Bytes of the stack that have been in use since, below `top`.
__attribute__((noinline)) inline int StackUsed(const void* top) {
  const uint32_t* at = StackLimit();
  while (*at == kPaint) ++at;
  return static_cast<int>(static_cast<const char*>(top) - reinterpret_cast<const char*>(at));
}

}  // namespace morphbus::test
