#pragma once
// What other programs' formats have no words for: how real joints and links differ from ideal ones.

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/emit/robot_tree.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// Adds a warning for each kind of model noise that module types among `types` (indices) have and a
/// file of `format` ("SDF") leaves out: backlash and delay of joints, spread of masses.
void WarnOfLeftOut(std::string_view format, const model::Model& model, const std::set<int>& types,
                   std::vector<std::string>* warnings);
/// The same for the module types of a tree.
void WarnOfLeftOut(std::string_view format, const model::Model& model, const RobotTree& tree,
                   std::vector<std::string>* warnings);

}  // namespace morphbus::emit
