#pragma once
// What is found out about a function from its own code, on the way through it.

#include <cstdint>

namespace morphbus::vm {

/// What one function's instructions need and may do. What the functions need that it calls is
/// found out by CallChecker.
struct CodeFacts {
  /// A bit for each keyword that it names, and for each slot that it calls.
  uint64_t keywords = 0;
  uint16_t methods_called = 0;
  /// One more than the function that it calls as the one it replaces; 0 if it calls none.
  uint16_t super_called = 0;
  /// The most operand cells that it needs.
  uint8_t max_stack = 0;
  /// The strongest Effect of its instructions.
  uint8_t effect = 0;
};

}  // namespace morphbus::vm
