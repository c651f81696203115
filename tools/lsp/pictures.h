#pragma once
// Small pictures for an editor: a module type, two modules that are mated, a robot.

#include <string>
#include <vector>

#include "compiler/base/role_colors.h"
#include "compiler/model/robot_model.h"
#include "logger/show/drawing.h"

namespace morphbus::tools {

/// A robot at its start values, `width_px` wide; modules have the colours of `colors[module]`, or
/// each its own where that is empty. Without a panel if there is nothing to see: no shapes, or more
/// than 200 modules.
logger::Drawing RobotDrawing(const model::Model& model, const model::Robot& robot,
                             const std::vector<Color>& colors, double width_px);
/// A module of this type, joints at 0.
logger::Drawing ModuleDrawing(const model::Model& model, int type, double width_px);
/// A module of type a and one of type b, mated by an option of a connection.
logger::Drawing MatedDrawing(const model::Model& model, int connection, int option,
                             double width_px);

/// The SVG of a drawing; empty if there is nothing to see.
std::string SvgOf(const logger::Drawing& drawing);
/// An image in Markdown that holds its own data, as SVG, or as PNG where that is too large for
/// editors; empty if there is nothing to see.
std::string PictureMarkdown(const logger::Drawing& drawing, const std::string& alt);

}  // namespace morphbus::tools
