#pragma once

namespace morphbus::elementary {

/// The angle of the vector (x, y), as atan2 has it: correctly rounded for all arguments, radians.
/// Special cases as in annex F of C: ArcTangent(-0, -1) is -pi.
double ArcTangent(double y, double x);
/// Both correctly rounded, radians; NaN beyond [-1, 1].
double ArcSine(double x);
double ArcCosine(double x);

}  // namespace morphbus::elementary
