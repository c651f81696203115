#pragma once

#include <mpfr.h>

/// Functions by GNU MPFR, which rounds correctly whatever the argument: microseconds each. For
/// functions that no run calls often, and for the few arguments of the others for which a rounding
/// test (RoundsTo) does not decide.
namespace morphbus::elementary {

/// The double nearest to function(x), ties to even: subnormal, infinite or 0 where IEEE 754 says
/// so, and of all NaNs always the same, positive and quiet. `function` is one of MPFR's, such as
/// mpfr_sin.
double Exactly(int (*function)(mpfr_t, const mpfr_t, mpfr_rnd_t), double x);

/// The same for functions of two numbers, such as mpfr_atan2; special cases as in annex F of C.
double Exactly(int (*function)(mpfr_t, const mpfr_t, const mpfr_t, mpfr_rnd_t), double x, double y);

}  // namespace morphbus::elementary
