#pragma once

namespace morphbus::elementary {

/// The natural logarithm, correctly rounded for every x, so that every machine gets the same bits
/// (docs/arithmetic.md). -infinity for 0, NaN below.
double Logarithm(double x);

}  // namespace morphbus::elementary
