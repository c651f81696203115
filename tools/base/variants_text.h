#pragma once
// Variants of a robot as a file in M3L.

#include <string>
#include <vector>

#include "compiler/congruence/variants.h"
#include "compiler/model/robot_model.h"

namespace morphbus::tools {

/// The text of `variants`, which are those of `robot`, a robot of `model`: a file that imports the
/// model by the path `import`, in the layout that `morphbus format` gives. A comment says of each
/// variant where its masses or hulls differ from the robot's.
std::string VariantsText(const model::Model& model, const model::Robot& robot,
                         const std::vector<congruence::Variant>& variants,
                         const std::string& import);

}  // namespace morphbus::tools
