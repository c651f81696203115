#pragma once

#include <cstdint>

namespace morphbus::bridge {

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
