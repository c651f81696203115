#pragma once
// Random numbers that are the same on every machine: the standard library's generators are, but its
// distributions are not.

#include <cstdint>

namespace morphbus {

/// SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014):
/// a counter whose values are mixed, so that it needs no more state than that.
class SplitMix64 {
 public:
  /// Generators with the same `state` give the same numbers.
  explicit SplitMix64(uint64_t state) : state_(state) {}

  /// The next number; all 64 bits are random.
  uint64_t Next() { return Mix(state_ += 0x9e3779b97f4a7c15ULL); }

  /// The next number from 0 up to, but not including, 1. A double holds 53 bits exactly.
  double NextFraction() { return static_cast<double>(Next() >> 11) * 0x1p-53; }

  /// A number that looks random, from any number; two unlike ones never give the same.
  static uint64_t Mix(uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  }

 private:
  /// The counter; it goes on by 2^64 over the golden ratio, an odd number, so that it comes back
  /// only after 2^64 steps.
  uint64_t state_;
};

}  // namespace morphbus
