#pragma once
// The functions of the language on floats. They use only operations that IEEE 754 defines to the
// bit (+ - * / and the square root, without contraction) and whole numbers, no function of a
// library that rounds in its own way, so host and microcontroller agree in every bit.

#include "vm/image/opcodes.h"

namespace morphbus::vm {

/// The value of one of kSin to kRound or kSign to kPow; `b` is the second operand of those that
/// have two. Angles are in degrees. Where the function has no value (asin(2), sqrt(-1), tan(90),
/// log(0)) it is not finite. The error is below 0.51 units in the last place for sine, cosine, the
/// arcs, exp, log and pow, and 1 for the tangent; multiples of 90 degrees are exact. Operands are
/// finite.
float Mathematics(Opcode function, float a, float b);
/// Whether `function` is one of these.
constexpr bool IsMathematics(Opcode function) {
  return (function >= Opcode::kSin && function <= Opcode::kRound) ||
         (function >= Opcode::kSign && function <= Opcode::kPow);
}

/// The whole number next to `x` toward zero; false if it does not fit into 32 bits.
bool ToInt(float x, int32_t* number);

/// What is left of `a` after division by `b`, which is not 0; exact, with the sign of `a` (as C's
/// fmodf).
float Modulo(float a, float b);

}  // namespace morphbus::vm
