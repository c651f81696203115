#include "sim/arithmetic.h"

#include <gtest/gtest.h>

#if defined(__x86_64__)

namespace morphbus::sim {
namespace {

// Elsewhere Bullet may have been compiled with contracted operations (docs/arithmetic.md).
TEST(Arithmetic, HasTheUsualFingerprint) { EXPECT_EQ(ArithmeticFingerprint(), kUsualArithmetic); }

}  // namespace
}  // namespace morphbus::sim

#endif
