#pragma once
// The links' hulls as mesh files, for formats that cannot hold a mesh themselves.

#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// Path of the mesh of a link, beside a main file called `stem`.something; empty for a link without
/// hull. Modules of one type share their meshes.
std::string MeshPath(const model::Model& model, const TreeLink& link, const std::string& stem);

/// The meshes of all links of the tree, as binary STL in metres, link frames; flat hulls thickened.
std::vector<CompanionFile> MeshFiles(const model::Model& model, const RobotTree& tree,
                                     const std::string& stem);

}  // namespace morphbus::emit
