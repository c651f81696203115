#pragma once
// The links' hulls as mesh files, for formats that cannot hold a mesh themselves.

#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

struct MeshPlace {
  std::string stem;    ///< Of the main file: the meshes lie in `stem`_meshes/ beside it.
  std::string prefix;  ///< Before that folder where the main file refers to it: "package://robot/".
};

/// Where the main file finds the mesh of a link; empty for a link without hull. Modules of one type
/// share their meshes.
std::string MeshAddress(const model::Model& model, const TreeLink& link, const MeshPlace& place);

/// The meshes of all links of the tree, as binary STL in metres, link frames; flat hulls thickened.
std::vector<CompanionFile> MeshFiles(const model::Model& model, const RobotTree& tree,
                                     const MeshPlace& place);

}  // namespace morphbus::emit
