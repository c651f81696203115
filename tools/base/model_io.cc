#include "tools/base/model_io.h"

#include <fmt/format.h>

#include "compiler/model/loop_constraints.h"
#include "tools/base/messages.h"

namespace morphbus::tools {

namespace {

/// Rounds nothing, but prints -0 as 0.
double Plain(double v) { return v == 0.0 ? 0.0 : v; }

}  // namespace

std::optional<model::Model> LoadModel(const std::vector<std::string>& paths,
                                      std::vector<std::string>* read) {
  // Warnings are printed even where there are errors, and the model that has errors is empty.
  m3l::CompileOutput output = m3l::CompileFiles(paths);
  PrintDiagnostics(output.diagnostics, output.sources);
  // The caller must not write over any of these files.
  for (int file = 0; read != nullptr && file < output.sources.size(); ++file) {
    read->push_back(output.sources.name(file));
  }
  return std::move(output.model);
}

const model::Robot* PickRobot(const model::Model& model, const std::string& name) {
  // A model with one robot needs no --robot; a wrong name gets the nearest one.
  std::vector<std::string> names;
  for (const model::Robot& robot : model.robots) names.push_back(robot.name);
  if (name.empty() && model.robots.size() == 1) return &model.robots.front();
  if (const model::Robot* robot = model.FindRobot(name)) return robot;
  // Nothing fits: which of the three reasons it is decides what the user can do.
  if (names.empty()) {
    Unusable("the model defines no robot");
  } else if (name.empty()) {
    Unusable(fmt::format("the model has several robots; choose one with --robot: {}",
                         fmt::join(names, ", ")));
  } else {
    Unusable(fmt::format("the model has no robot '{}'{}; it has {}", name, DidYouMean(name, names),
                         fmt::join(names, ", ")));
  }
  return nullptr;
}

Json PoseJson(const model::Pose& X) {
  // q and -q are one rotation: the one with w >= 0 stands for both, so that texts can be compared.
  Eigen::Quaterniond q(X.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return Json{{"p", VectorJson(X.translation())},
              {"q", Json::array({Plain(q.w()), Plain(q.x()), Plain(q.y()), Plain(q.z())})}};
}

Json VectorJson(const Eigen::Vector3d& v) {
  return Json::array({Plain(v.x()), Plain(v.y()), Plain(v.z())});
}

Json AttributeJson(const model::AttributeValue& value) {
  // JSON has a type for each of the alternatives, so the visitor only wraps the value.
  return std::visit([](const auto& v) { return Json(v); }, value);
}

std::string MobilityText(const model::KinematicGraph& graph) {
  if (graph.mobility) return fmt::format("mobility {}", *graph.mobility);
  // The limit is named, so that nobody looks for a mistake in the model.
  return fmt::format("mobility not computed (over {} joints in one system of loops)",
                     model::kMaxLoopJoints);
}

}  // namespace morphbus::tools
