#pragma once
// Sine and cosine by operations that IEEE 754 defines to the bit (+ - * without contraction), so
// that host and microcontroller agree in every bit; a library's own functions need not.

namespace morphbus::vm {

/// sin(x) and cos(x) for |x| <= pi/4, x in radians. By Taylor's series: the first terms left out
/// are below 3e-14 and 4e-13.
double SineSeries(double x);
double CosineSeries(double x);

struct SineCosine {
  float sine, cosine;
};

/// Both of an angle in radians; the error is below 0.51 units in the last place up to 1e5 radians.
/// Beyond 1e9, where a float's neighbour is many turns away, and of what is no number, it is that
/// of 0.
SineCosine SineCosineOf(float angle_rad);

}  // namespace morphbus::vm
