#include "tools/base/model_io.h"

#include <fmt/format.h>

#include "compiler/model/loop_constraints.h"
#include "compiler/model/pose_numbers.h"

namespace morphbus::tools {

namespace {

/// Rounds nothing, but prints -0 as 0.
double Plain(double v) { return v == 0.0 ? 0.0 : v; }

}  // namespace

std::vector<std::string> ModelSource::Files() const {
  std::vector<std::string> files;
  for (int file = 0; file < sources.size(); ++file) files.push_back(sources.name(file));
  return files;
}

std::optional<model::Model> LoadModel(const std::vector<std::string>& paths, ModelSource* source) {
  // Warnings are printed even where there are errors, and the model that has errors is empty.
  m3l::CompileOutput output = m3l::CompileFiles(paths);
  PrintDiagnostics(output.diagnostics, output.sources);
  if (source != nullptr) *source = {output.sources, std::move(output.modules)};
  return std::move(output.model);
}

std::string WhyNoneOf(const std::vector<std::string>& names, const std::string& name,
                      const std::string& what) {
  if (names.empty()) return fmt::format("the model defines no {}", what);
  if (name.empty()) {
    return fmt::format("the model has several {0}s; choose one with --{0}: {1}", what,
                       fmt::join(names, ", "));
  }
  return fmt::format("the model has no {} '{}'{}; it has {}", what, name, DidYouMean(name, names),
                     fmt::join(names, ", "));
}

Result<int> FindModule(const model::Robot& robot, const std::string& name) {
  // Of a misspelt name the nearest is suggested.
  if (const std::optional<int> module = robot.FindModule(name)) return *module;
  return Fail(fmt::format("robot {} has no module '{}'{}", robot.name, name,
                          DidYouMean(name, NamesOf(robot.modules))));
}

Json PoseJson(const model::Pose& X) {
  const model::PoseNumbers numbers = model::NumbersOf(X);
  return Json{{"p", numbers.position}, {"q", numbers.rotation}};
}

Json VectorJson(const Eigen::Vector3d& v) {
  return Json::array({Plain(v.x()), Plain(v.y()), Plain(v.z())});
}

std::vector<double> Numbers(const Json& array) { return array.get<std::vector<double>>(); }

Json AttributeJson(const model::AttributeValue& value) {
  // JSON has a type for each of the alternatives, so the visitor only wraps the value.
  return std::visit([](const auto& v) { return Json(v); }, value);
}

std::string MobilityText(const model::KinematicGraph& graph) {
  if (graph.mobility) return fmt::format("mobility {}", *graph.mobility);
  // The limit is named, so that users do not look for a mistake in the model.
  return fmt::format("mobility not computed (over {} joints in one system of loops)",
                     model::kMaxLoopJoints);
}

}  // namespace morphbus::tools
