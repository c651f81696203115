#pragma once

namespace morphbus::elementary {

/// The natural logarithm, correctly rounded. -infinity for 0, NaN below.
double Logarithm(double x);

}  // namespace morphbus::elementary
