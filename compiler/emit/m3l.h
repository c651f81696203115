#pragma once
// A robot as M3L text.

#include <string>

#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// The definition of `robot`, which need not be one of `model`'s: connections by number, the frame,
/// start values that are not 0. In one line: layout is for m3l::Format. Compiled beside the model's
/// module types and connections it gives the robot back.
std::string RobotM3l(const model::Model& model, const model::Robot& robot);

}  // namespace morphbus::emit
