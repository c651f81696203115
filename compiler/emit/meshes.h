#pragma once
// The links' hulls, and obstacles that are meshes, as mesh files, for formats that cannot hold a
// mesh themselves.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/robot_tree.h"
#include "compiler/model/convex_hull.h"
#include "compiler/world/obstacle.h"

namespace morphbus::emit {

/// Where mesh files lie, and how the main file refers to them. Some programs look for meshes by the
/// name of a package and not by a path.
struct MeshPlace {
  std::string stem;    ///< Of the main file: the meshes lie in `stem`_meshes/ beside it.
  std::string prefix;  ///< Before that folder where the main file refers to it: "package://robot/".
};

/// Names of a link's meshes by module type and link, without folder and extension, one a convex
/// part: "MTRAN.active_block"; none for a link without hull.
std::vector<std::string> MeshNames(const model::Model& model, const TreeLink& link);

/// A part of how a link looks, as a solid mesh in the link's own frame (m).
struct LookMesh {
  std::string name;  ///< "MTRAN.active_block.look1"
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
  std::optional<Color> color;  ///< Absent: the module's.
};

/// How a link looks that does not look like its hull; none for one that does. Flat parts are
/// thickened. Modules of one type share their meshes. `type` and `link` are indices of a module
/// type and of a link in it.
std::vector<LookMesh> LooksOf(const model::Model& model, int type, int link);

/// Where the main file finds the mesh of a part of how a link looks.
std::string LookAddress(const LookMesh& look, const MeshPlace& place);

/// All of them in the tree, each once, by name.
std::map<std::string, LookMesh> LooksOf(const model::Model& model, const RobotTree& tree);

/// What part number `number`, counted from 1, of something that is called `name` is called.
std::string PartName(const std::string& name, size_t number);

/// Where the main file finds the meshes of a link: prefix, folder and file name. None for a link
/// without hull. Modules of one type share their meshes.
std::vector<std::string> MeshAddresses(const model::Model& model, const TreeLink& link,
                                       const MeshPlace& place);

/// The triangles of an obstacle that has a mesh as binary STL, in metres in its own frame; `number`
/// tells it from others. The main file finds it at `place.prefix` and the file's path.
CompanionFile ObstacleMesh(const world::Obstacle& obstacle, size_t number, const MeshPlace& place);

/// The convex parts of all links of the tree, by the names of their meshes; modules of one type
/// share theirs.
std::map<std::string, model::ConvexHull> MeshesOf(const model::Model& model, const RobotTree& tree);

/// The meshes of all links of the tree, their hulls and how they look, each once, as binary STL:
/// corners in metres in the link's own frame. A flat hull is thickened, since other programs take
/// no mesh without a volume.
std::vector<CompanionFile> MeshFiles(const model::Model& model, const RobotTree& tree,
                                     const MeshPlace& place);

}  // namespace morphbus::emit
