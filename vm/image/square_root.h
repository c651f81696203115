#pragma once
// Square roots as IEEE 754 defines them, rounded to nearest: the same bits on every machine.

namespace morphbus::vm {

/// The square root of `x`; not a number for numbers below zero. Where the processor has no
/// instruction for it, the digits are found one by one, in less code than a library's.
float SquareRoot(float x);
double SquareRoot(double x);

/// The second by whole numbers alone, for tests of it on machines that have the instruction.
double SquareRootByDigits(double x);

}  // namespace morphbus::vm
