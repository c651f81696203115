#include "test/compiler/congruence/texts.h"

#include <fmt/format.h>

#include "compiler/base/check.h"
#include "compiler/m3l/compile.h"

namespace morphbus::test {

model::Model Compiled(const std::string& text) {
  const m3l::CompileOutput output = m3l::CompileText("text.m3l", text);
  if (!output.model)
    fmt::print(stderr, "{}", source::Render(output.diagnostics, output.sources, false));
  MORPHBUS_CHECK(output.model.has_value());
  return *output.model;
}

std::string Socket(const std::string& name, const Eigen::Vector3d& p) {
  const auto point = [](const Eigen::Vector3d& v) {
    return fmt::format("({}, {}, {})", v.x(), v.y(), v.z());
  };
  return fmt::format("point {}: (point _1: coords={}) (point _2: coords={}) coords={}, connector\n",
                     name, point(p + Eigen::Vector3d(1, 0, 0)), point(p + Eigen::Vector3d(0, 2, 0)),
                     point(p));
}

std::string Joining(const std::string& module_a, const std::string& module_b) {
  return fmt::format(
      "connection {0}_{1}: members=({0} a, {1} b), conditions=(a.point p coincident b.point q and "
      "p._1 coincident q._1 and p._2 coincident q._2)\n",
      module_a, module_b);
}

const model::Robot& Named(const model::Model& model, const std::string& name) {
  const model::Robot* robot = model.FindRobot(name);
  MORPHBUS_CHECK(robot != nullptr);
  return *robot;
}

}  // namespace morphbus::test
