#include "compiler/congruence/explain_text.h"

#include <fmt/format.h>

#include <cmath>

namespace morphbus::congruence {

std::string Counted(size_t count, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", count == 0 ? "no" : std::to_string(count), count == 1 ? one : many);
}

double Plain(double v) { return std::abs(v) < 5e-7 ? 0.0 : v; }

std::string Text(const Eigen::Vector3d& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", Plain(v.x()), Plain(v.y()), Plain(v.z()));
}

std::string ValueText(const AssemblyJoint& j, double value) {
  return j.slide ? fmt::format("{:.6g} m", Plain(value))
                 : fmt::format("{:.6g} degrees", Plain(value * kDegrees));
}

std::string RangeText(const AssemblyJoint& j) {
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
