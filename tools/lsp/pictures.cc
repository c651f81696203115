#include "tools/lsp/pictures.h"

#include <utility>
#include <vector>

#include "compiler/base/base64.h"
#include "compiler/model/forward_kinematics.h"
#include "logger/show/drawing.h"

namespace morphbus::tools {
namespace {

/// More modules are too small to be told apart, and take long to draw.
constexpr size_t kMostDrawn = 200;
/// Visual Studio Code cuts a hover text off at 100,000 characters, and a picture with it.
constexpr size_t kMostPictureBytes = 90'000;

/// A module of a type, all joints at 0.
model::ModuleInstance ModuleOf(const model::Model& model, int type, const std::string& name) {
  model::ModuleInstance module;
  module.name = name;
  module.type = type;
  module.start.assign(model.module_types[type].joints.size(), 0.0);
  return module;
}

}  // namespace

std::string RobotSvg(const model::Model& model, const model::Robot& robot,
                     const std::vector<Color>& colors, double width_px) {
  if (robot.modules.size() > kMostDrawn) return "";
  std::vector<Color> used = colors;
  for (size_t m = used.size(); m < robot.modules.size(); ++m) {
    used.push_back(PaletteColor(static_cast<int>(m)));
  }
  const model::KinematicState state =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  logger::Drawing drawing;
  drawing.panel_width_px = width_px;
  logger::Panel& panel = drawing.panels.emplace_back();
  panel.scene = logger::SceneOf(model, robot, state.X_RL, used);
  panel.scene.ground = false;
  panel.view = logger::View::kThreeQuarter;
  if (panel.scene.hulls.empty()) return "";
  const Result<std::string> svg = logger::RenderPicture(drawing, "picture.svg");
  return svg ? *svg : "";
}

std::string ModuleSvg(const model::Model& model, int type, double width_px) {
  model::Robot robot;
  robot.modules.push_back(ModuleOf(model, type, ""));
  return RobotSvg(model, robot, {}, width_px);
}

std::string MatedSvg(const model::Model& model, int connection, int option, double width_px) {
  const model::ConnectionType& type = model.connection_types[connection];
  model::Robot robot;
  robot.modules.push_back(ModuleOf(model, type.type_a, "a"));
  robot.modules.push_back(ModuleOf(model, type.type_b, "b"));
  model::Docking& docking = robot.dockings.emplace_back();
  docking.module_b = 1;
  docking.connector_a = type.options[option].connector_a;
  docking.connector_b = type.options[option].connector_b;
  docking.connection_type = connection;
  docking.option = option;
  return RobotSvg(model, robot, {}, width_px);
}

std::string PictureMarkdown(const std::string& svg, const std::string& alt) {
  if (svg.empty()) return "";
  const std::string data = Base64(svg);
  if (data.size() > kMostPictureBytes) return "";
  return "![" + alt + "](data:image/svg+xml;base64," + data + ")";
}

}  // namespace morphbus::tools
