#pragma once
// Small steps of instructions on cells, whose types the verifier has proved.

#include <cstdint>

#include "vm/image/directions.h"
#include "vm/image/fault.h"
#include "vm/image/values.h"

namespace morphbus::vm {

/// Operands are of the types that the verifier has proved.
inline float FromCell(Cell cell) { return cell.AsFloat(); }

/// A cell that holds a direction or axis holds its number.
inline Direction DirectionOf(Cell cell) { return static_cast<Direction>(cell.bits); }
inline Axis AxisIn(Cell cell) { return static_cast<Axis>(cell.bits); }

/// Tenths or hundredths of a second as microseconds; negative ones are none, absurd ones a century.
inline int64_t Microseconds(float amount, double unit_us) {
  const double us = static_cast<double>(amount) * unit_us;
  constexpr double kCentury = 3.2e15;
  if (!(us > 0)) return 0;
  return static_cast<int64_t>((us < kCentury ? us : kCentury) + 0.5);
}

/// Microseconds as whole milliseconds, rounded toward zero; false if they do not fit. Without a
/// division of 64 bits, which takes a kilobyte where the processor has none: the quotient of
/// doubles is off by one at most, and what is left says so.
inline bool ToMilliseconds(int64_t us, int32_t* ms) {
  const uint64_t size = us < 0 ? -static_cast<uint64_t>(us) : static_cast<uint64_t>(us);
  if (size / 1024 > INT32_MAX) return false;
  auto quotient = static_cast<int64_t>(static_cast<double>(static_cast<int64_t>(size)) * 1e-3);
  const int64_t rest = static_cast<int64_t>(size) - quotient * 1000;
  quotient += rest < 0 ? -1 : rest >= 1000 ? 1 : 0;
  if (quotient > INT32_MAX) return false;
  *ms = static_cast<int32_t>(us < 0 ? -quotient : quotient);
  return true;
}

/// Quotient, rounded toward zero. The lowest integer divided by -1 does not fit.
inline FaultCode DivideInt(int32_t a, int32_t b, int32_t* result) {
  if (b == 0) return FaultCode::kDivisionByZero;
  if (b == -1)
    return __builtin_sub_overflow(0, a, result) ? FaultCode::kIntegerOverflow : FaultCode::kNone;
  *result = a / b;
  return FaultCode::kNone;
}

/// The only member of a mask, or -1.
inline int OnlyBit(uint32_t mask) {
  return mask != 0 && (mask & (mask - 1)) == 0 ? __builtin_ctz(mask) : -1;
}

}  // namespace morphbus::vm
