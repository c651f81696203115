#pragma once
// Turns untrusted bytes into a VerifiedProgram, once, in linear time.

#include <cstdint>

#include "vm/program.h"

namespace morphbus::vm {

struct VerifyError {
  const char* message = nullptr;  ///< nullptr: accepted.
  uint32_t offset = 0;            ///< Byte of the image at which it was noticed.
};

class Verifier {
 public:
  /// Checks `bytes` (header, hash, every table, every instruction: jumps, stack depth, types, arity,
  /// bounded call depth, finite numbers) and fills `out`, which then refers to `bytes`. On error
  /// `out` is left empty (size() == 0).
  static VerifyError Verify(const uint8_t* bytes, uint32_t size, VerifiedProgram* out);
};

}  // namespace morphbus::vm
