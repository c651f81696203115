#include "bridge/wire/arithmetic_hash.h"

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "bridge/wire/stream_hash.h"
#include "compiler/base/big_endian.h"
#include "vm/run/mathematics.h"

namespace morphbus::bridge {
namespace {

/// Ones whose fractions do not end, one next to 1, very large and small ones, and subnormal ones.
template <class T>
constexpr std::array<T, 10> kOperands = {T(1) / 3,
                                         T(-1) / 7,
                                         1 + std::numeric_limits<T>::epsilon(),
                                         T(1) / 10,
                                         1 - std::numeric_limits<T>::epsilon(),
                                         std::numeric_limits<T>::min(),
                                         std::numeric_limits<T>::min() / 4,
                                         std::numeric_limits<T>::denorm_min() * 5,
                                         std::numeric_limits<T>::max() / 5,
                                         T(-12345.678)};

/// The operations that IEEE 754 defines, on all pairs, and those that a compiler may contract or
/// reassociate if it is let.
template <class T>
void AddOperations(NumberHash* results) {
  // Each operation reads them anew, so that the compiler can neither compute it itself nor take a
  // product from another one, which it would not contract.
  std::array<volatile T, 10> x;
  for (size_t i = 0; i < x.size(); ++i) x[i] = kOperands<T>[i];
  for (const volatile T& a : x) {
    for (const volatile T& b : x) {
      results->Add(a + b);
      results->Add(a - b);
      results->Add(a / b);
      const volatile T product = a * b;
      results->Add(T(product));
      // 0, unless the product is rounded together with the difference.
      results->Add(a * b - product);
      results->Add(product - a * b);
      // A compiler or a processor that fuses the product with the sum rounds once instead of twice.
      for (const volatile T& c : x) {
        results->Add(a * b + c);
        results->Add(a + b + c);
      }
    }
  }
  // In this order and no other, as would be that of a processor's vectors.
  T sum = 0;
  T squares = 0;
  for (int i = 0; i < 64; ++i) {
    const T term = x[i % 5] / T(i + 1);
    sum += term;
    squares += term * term;
  }
  results->Add(sum);
  results->Add(squares);
}

/// From one kind of number to another.
void AddConversions(NumberHash* results) {
  // Narrowing rounds, and may flush subnormal numbers to 0.
  for (const double x : kOperands<double>) {
    const volatile double wide = x;
    results->Add(static_cast<float>(wide));
  }
  for (const float x : kOperands<float>) {
    const volatile float narrow = x;
    results->Add(static_cast<double>(narrow));
  }
  // These whole numbers have no exact double or float, so that the rounding shows.
  for (const int64_t n : {(int64_t{1} << 53) + 1, (int64_t{1} << 62) - 1, int64_t{-16777217}}) {
    const volatile int64_t whole = n;
    results->Add(static_cast<double>(whole));
    results->Add(static_cast<float>(whole));
  }
  // Towards zero, as C++ demands.
  for (const double x : {2.5, -2.5, 1e9 + 0.999, -0.999}) {
    const volatile double fraction = x;
    results->Add(static_cast<int64_t>(fraction));
  }
}

/// What programs and the virtual machine itself compute.
void AddFunctions(NumberHash* results) {
  for (int op = static_cast<int>(vm::Opcode::kSin); op <= static_cast<int>(vm::Opcode::kRound);
       ++op) {
    // Inside and outside of the ranges in which functions such as the arc sine are defined.
    for (const float a : {0.0f, 0.3f, -0.77f, 1.0f, 45.5f, -123.4f, 98765.4f}) {
      for (const float b : {-0.25f, 3.3f}) {
        results->Add(vm::Mathematics(static_cast<vm::Opcode>(op), a, b));
      }
    }
  }
  for (const float a : kOperands<float>) results->Add(vm::Modulo(a, 0.7f));
}

}  // namespace

void NumberHash::Add(double x) {
  if (std::isnan(x)) x = std::numeric_limits<double>::quiet_NaN();
  AddBits(std::bit_cast<uint64_t>(x));
}

void NumberHash::Add(float x) {
  if (std::isnan(x)) x = std::numeric_limits<float>::quiet_NaN();
  AddBits(std::bit_cast<uint32_t>(x));
}

void NumberHash::AddBits(uint64_t bits) {
  bytes_.resize(bytes_.size() + sizeof bits);
  StoreBigEndian(bits, bytes_.data() + bytes_.size() - sizeof bits);
}

uint64_t NumberHash::Digest() const { return DigestOf(bytes_.data(), bytes_.size()); }

uint64_t EvaluateArithmetic() {
  NumberHash results;
  AddOperations<double>(&results);
  AddOperations<float>(&results);
  AddConversions(&results);
  AddFunctions(&results);
  return results.Digest();
}

uint64_t ArithmeticHash() {
  static const uint64_t hash = EvaluateArithmetic();
  return hash;
}

}  // namespace morphbus::bridge
