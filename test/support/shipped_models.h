#pragma once
// The models that ship, with all directions of their connectors.

#include <map>
#include <string>

#include "compiler/model/robot_model.h"

namespace morphbus::test {

/// What a text says, read as if it stood in the file `path` (so that it may import its neighbours);
/// every connector has its normals. What does not compile fails at once.
model::Model DirectedModel(const std::string& path, const std::string& text);

/// The models in models/ by the names of their files, as above.
std::map<std::string, model::Model> ShippedModels();

}  // namespace morphbus::test
