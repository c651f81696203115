#include "compiler/congruence/explain_text.h"

#include <fmt/format.h>

#include <cmath>

#include "compiler/base/text.h"

namespace morphbus::congruence {

std::string CountedOrNo(size_t count, const std::string& one, const std::string& many) {
  if (count == 0) return "no " + (many.empty() ? one + "s" : many);
  return Counted(static_cast<int64_t>(count), one, many);
}

// Six significant digits are printed, so less than half a millionth is rounding.
double Plain(double v) { return std::abs(v) < 5e-7 ? 0.0 : v; }

std::string Text(const Eigen::Vector3d& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", Plain(v.x()), Plain(v.y()), Plain(v.z()));
}

std::string ValueText(const ScrewJoint& j, double value) {
  // A slide has metres, a joint that turns degrees.
  return j.slide ? fmt::format("{:.6g} m", Plain(value))
                 : fmt::format("{:.6g} degrees", Plain(value * kDegrees));
}

std::string RangeText(const ScrewJoint& j) {
  // Limits are printed in degrees or metres, then whether the joint is within one body.
  std::string text = j.slide ? "slides" : "turns";
  if (!j.bounded()) {
    text += " without limits";
  } else {
    const double unit = j.slide ? 1.0 : kDegrees;
    text += fmt::format(" from {:.6g} to {:.6g} {}", Plain(j.lower * unit), Plain(j.upper * unit),
                        j.slide ? "m" : "degrees");
  }
  return j.body_a == j.body_b ? text + ", with both ends in one body" : text;
}

}  // namespace morphbus::congruence
