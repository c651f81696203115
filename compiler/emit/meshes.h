#pragma once
// The links' hulls as mesh files, for formats that cannot hold a mesh themselves.

#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// Where mesh files lie, and how the main file refers to them. Some programs look for meshes by the
/// name of a package and not by a path.
struct MeshPlace {
  std::string stem;    ///< Of the main file: the meshes lie in `stem`_meshes/ beside it.
  std::string prefix;  ///< Before that folder where the main file refers to it: "package://robot/".
};

/// Name of a link's mesh by module type and link, without folder and extension:
/// "MTRAN.active_block"; empty for a link without hull.
std::string MeshName(const model::Model& model, const TreeLink& link);

/// Where the main file finds the mesh of a link: prefix, folder and file name. Empty for a link
/// without hull. Modules of one type share their meshes.
std::string MeshAddress(const model::Model& model, const TreeLink& link, const MeshPlace& place);

/// The meshes of all links of the tree, each once, as binary STL: corners in metres in the link's
/// own frame. A flat hull is thickened, since other programs take no mesh without a volume.
std::vector<CompanionFile> MeshFiles(const model::Model& model, const RobotTree& tree,
                                     const MeshPlace& place);

}  // namespace morphbus::emit
