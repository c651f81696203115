#include "tools/lsp/pictures.h"

#include <cmath>
#include <utility>
#include <vector>

#include "compiler/base/base64.h"
#include "compiler/model/forward_kinematics.h"

namespace morphbus::tools {
namespace {

/// More modules are too small to be told apart, and take long to draw.
constexpr size_t kMostDrawn = 200;
/// Visual Studio Code cuts a hover text off at 100,000 characters, and a picture with it.
constexpr size_t kMostPictureBytes = 90'000;
/// An SVG of shapes with more corners would be larger; it is not even tried.
constexpr size_t kMostSvgCorners = 250;
/// A picture that is smaller shows nothing.
constexpr double kLeastPictureWidth = 80;

/// A module of a type, all joints at 0.
model::ModuleInstance ModuleOf(const model::Model& model, int type, const std::string& name) {
  model::ModuleInstance module;
  module.name = name;
  module.type = type;
  module.start.assign(model.module_types[type].joints.size(), 0.0);
  return module;
}

}  // namespace

logger::Drawing RobotDrawing(const model::Model& model, const model::Robot& robot,
                             const std::vector<Color>& colors, double width_px) {
  logger::Drawing drawing;
  drawing.panel_width_px = width_px;
  if (robot.modules.size() > kMostDrawn) return drawing;
  const std::vector<Color> used = colors.empty() ? PaletteColors(robot.modules.size()) : colors;
  const model::KinematicState state =
      model::ForwardKinematics(model, robot, model::StartValues(robot));
  logger::Panel panel;
  panel.scene = logger::SceneOf(model, robot, state.X_RL, used);
  panel.scene.ground = false;
  panel.view = logger::View::kThreeQuarter;
  if (!panel.scene.hulls.empty()) drawing.panels.push_back(std::move(panel));
  return drawing;
}

logger::Drawing ModuleDrawing(const model::Model& model, int type, double width_px) {
  model::Robot robot;
  robot.modules.push_back(ModuleOf(model, type, ""));
  return RobotDrawing(model, robot, {}, width_px);
}

logger::Drawing MatedDrawing(const model::Model& model, int connection, int option,
                             double width_px) {
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
  return RobotDrawing(model, robot, {}, width_px);
}

std::string SvgOf(const logger::Drawing& drawing) {
  if (drawing.panels.empty()) return "";
  const Result<std::string> svg = logger::RenderPicture(drawing, "picture.svg");
  return svg ? *svg : "";
}

std::string PictureMarkdown(const logger::Drawing& drawing, const std::string& alt) {
  if (drawing.panels.empty()) return "";
  size_t corners = 0;
  for (const logger::SceneHull& hull : drawing.panels[0].scene.hulls) {
    corners += hull.points_L.size();
  }
  const std::string data = corners <= kMostSvgCorners ? Base64(SvgOf(drawing)) : "";
  if (!data.empty() && data.size() <= kMostPictureBytes) {
    return "![" + alt + "](data:image/svg+xml;base64," + data + ")";
  }
  // What has many faces takes less as pixels, of which there are two to each of the width; the
  // picture is as large as there is room for.
  logger::Drawing smaller = drawing;
  for (; smaller.panel_width_px >= kLeastPictureWidth; smaller.panel_width_px *= 0.7) {
    const Result<std::string> png = logger::RenderPicture(smaller, "picture.png");
    const std::string pixels = png ? Base64(*png) : "";
    if (pixels.empty()) return "";
    if (pixels.size() > kMostPictureBytes) continue;
    return "![" + alt + "|width=" + std::to_string(std::lround(smaller.panel_width_px)) +
           "](data:image/png;base64," + pixels + ")";
  }
  return "";
}

}  // namespace morphbus::tools
