#pragma once
// Small pictures for an editor: a module type, two modules that are mated, a robot.

#include <map>
#include <string>

#include "compiler/base/role_colors.h"
#include "compiler/model/robot_model.h"

namespace morphbus::tools {

/// The SVG of a robot at its start values, `width_px` wide; modules have the colours of
/// `colors[module]`, or each its own where that is empty. Empty if it cannot be drawn, as when
/// nothing has a shape or there are more than 200 modules.
std::string RobotSvg(const model::Model& model, const model::Robot& robot,
                     const std::vector<Color>& colors, double width_px);
/// A module of this type, joints at 0.
std::string ModuleSvg(const model::Model& model, int type, double width_px);
/// A module of type a and one of type b, mated by an option of a connection.
std::string MatedSvg(const model::Model& model, int connection, int option, double width_px);

/// An image in Markdown that holds its own data; empty for an empty SVG, or one too large for the
/// editors that show it.
std::string PictureMarkdown(const std::string& svg, const std::string& alt);

}  // namespace morphbus::tools
