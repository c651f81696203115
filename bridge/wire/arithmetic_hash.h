#pragma once

#include <cstdint>
#include <vector>

namespace morphbus::bridge {

/// Hash of numbers, bit by bit, the same on machines of any byte order. A NaN counts as one,
/// whichever it is: IEEE 754 leaves open which one an operation makes.
class NumberHash {
 public:
  void Add(double x);
  void Add(float x);
  void Add(int64_t x) { AddBits(static_cast<uint64_t>(x)); }
  /// XXH3 (64 bits) of all numbers so far, in their order.
  [[nodiscard]] uint64_t Digest() const;

 private:
  void AddBits(uint64_t bits);

  std::vector<uint8_t> bytes_;
};

/// Hash of what this process' arithmetic makes of a fixed set of operations: sums, products and
/// quotients of doubles and floats, whether products are contracted with sums and sums
/// reassociated, roots, subnormal numbers, conversions, and the functions of the virtual machine
/// (vm/run/mathematics.h). Two processes in which it differs would publish different payloads for
/// the same input (docs/arithmetic.md). Elementary functions and the physics engine, which only the
/// simulator uses, are none of it (sim/arithmetic.h). Computed once, in some 100 microseconds.
uint64_t ArithmeticHash();

/// The same, computed anew: under the rounding mode of now, say.
uint64_t EvaluateArithmetic();

}  // namespace morphbus::bridge
