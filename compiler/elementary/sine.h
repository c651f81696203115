#pragma once

namespace morphbus::elementary {

/// Both are correctly rounded for every x (radians): the double nearest to the true value, and so
/// the same bits on every machine (docs/arithmetic.md). NaN for infinities and NaN.
double Sine(double x);
double Cosine(double x);

}  // namespace morphbus::elementary
