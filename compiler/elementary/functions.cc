#include "compiler/elementary/arc_tangent.h"
#include "compiler/elementary/exact.h"
#include "compiler/elementary/logarithm.h"
#include "compiler/elementary/sine.h"

// The C library's elementary functions, each correctly rounded: so there is one right result, which
// no processor, compiler or library can change. A program that links this file calls these, and so
// do the shared libraries that it loads, Bullet above all: a symbol that the program itself exports
// is found before those of libm. errno is left alone, and rounding is to nearest.
//
// What IEEE 754 itself defines to the bit, such as sqrt, fmod, floor and fma, stays libm's.

using morphbus::elementary::ArcCosine;
using morphbus::elementary::ArcSine;
using morphbus::elementary::ArcTangent;
using morphbus::elementary::Cosine;
using morphbus::elementary::Exactly;
using morphbus::elementary::Logarithm;
using morphbus::elementary::Sine;

extern "C" {

/// Linkers take this file for its sake (CMakeLists.txt), even where they have found the functions
/// in libm before.
extern const int morphbus_elementary_functions;
const int morphbus_elementary_functions = 1;

double sin(double x) noexcept { return Sine(x); }
double cos(double x) noexcept { return Cosine(x); }
double tan(double x) noexcept { return Exactly(mpfr_tan, x); }
double asin(double x) noexcept { return ArcSine(x); }
double acos(double x) noexcept { return ArcCosine(x); }
double atan(double x) noexcept { return ArcTangent(x, 1); }
double sinh(double x) noexcept { return Exactly(mpfr_sinh, x); }
double cosh(double x) noexcept { return Exactly(mpfr_cosh, x); }
double tanh(double x) noexcept { return Exactly(mpfr_tanh, x); }
double asinh(double x) noexcept { return Exactly(mpfr_asinh, x); }
double acosh(double x) noexcept { return Exactly(mpfr_acosh, x); }
double atanh(double x) noexcept { return Exactly(mpfr_atanh, x); }
double exp(double x) noexcept { return Exactly(mpfr_exp, x); }
double exp2(double x) noexcept { return Exactly(mpfr_exp2, x); }
double expm1(double x) noexcept { return Exactly(mpfr_expm1, x); }
double log(double x) noexcept { return Logarithm(x); }
double log2(double x) noexcept { return Exactly(mpfr_log2, x); }
double log10(double x) noexcept { return Exactly(mpfr_log10, x); }
double log1p(double x) noexcept { return Exactly(mpfr_log1p, x); }
double cbrt(double x) noexcept { return Exactly(mpfr_cbrt, x); }
double atan2(double y, double x) noexcept { return ArcTangent(y, x); }
double hypot(double x, double y) noexcept { return Exactly(mpfr_hypot, x, y); }
// Bullet calls it for every body in every step, to damp by nothing.
double pow(double x, double y) noexcept { return x == 1 ? 1 : Exactly(mpfr_pow, x, y); }
void sincos(double x, double* sine, double* cosine) noexcept {
  *sine = Sine(x);
  *cosine = Cosine(x);
}

// The float nearest to the double: defined to the bit, and at most a 2^-29th beyond half a place
// off.
float sinf(float x) noexcept { return static_cast<float>(sin(x)); }
float cosf(float x) noexcept { return static_cast<float>(cos(x)); }
float tanf(float x) noexcept { return static_cast<float>(tan(x)); }
float asinf(float x) noexcept { return static_cast<float>(asin(x)); }
float acosf(float x) noexcept { return static_cast<float>(acos(x)); }
float atanf(float x) noexcept { return static_cast<float>(atan(x)); }
float sinhf(float x) noexcept { return static_cast<float>(sinh(x)); }
float coshf(float x) noexcept { return static_cast<float>(cosh(x)); }
float tanhf(float x) noexcept { return static_cast<float>(tanh(x)); }
float asinhf(float x) noexcept { return static_cast<float>(asinh(x)); }
float acoshf(float x) noexcept { return static_cast<float>(acosh(x)); }
float atanhf(float x) noexcept { return static_cast<float>(atanh(x)); }
float expf(float x) noexcept { return static_cast<float>(exp(x)); }
float exp2f(float x) noexcept { return static_cast<float>(exp2(x)); }
float expm1f(float x) noexcept { return static_cast<float>(expm1(x)); }
float logf(float x) noexcept { return static_cast<float>(log(x)); }
float log2f(float x) noexcept { return static_cast<float>(log2(x)); }
float log10f(float x) noexcept { return static_cast<float>(log10(x)); }
float log1pf(float x) noexcept { return static_cast<float>(log1p(x)); }
float cbrtf(float x) noexcept { return static_cast<float>(cbrt(x)); }
float atan2f(float y, float x) noexcept { return static_cast<float>(atan2(y, x)); }
float hypotf(float x, float y) noexcept { return static_cast<float>(hypot(x, y)); }
float powf(float x, float y) noexcept { return static_cast<float>(pow(x, y)); }
void sincosf(float x, float* sine, float* cosine) noexcept {
  *sine = sinf(x);
  *cosine = cosf(x);
}

}  // extern "C"
