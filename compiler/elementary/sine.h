#pragma once

namespace morphbus::elementary {

/// Correctly rounded for every x, radians; NaN for infinities and NaN.
double Sine(double x);
double Cosine(double x);

}  // namespace morphbus::elementary
