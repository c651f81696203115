#pragma once
// The bodies of a robot in MuJoCo's format (MJCF): links, joints, masses and what touches.

#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "compiler/emit/exported.h"
#include "compiler/emit/link_solids.h"
#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// Time constant (s) with which a drive at full force comes to its full speed.
inline constexpr double kMjcfRunUp = 3e-3;

/// The folder of a deep tree's parts, beside the main file: "robot_parts".
std::string MjcfPartsFolder(const std::string& stem);

/// Name of the body that a joint which closes a loop moves: "m1.joint_1.loop".
std::string MjcfLoopBody(const TreeLoop& loop);

/// How a geom grips that has a friction of its own. By its higher priority that counts, and not the
/// greater of two.
void AppendMjcfFriction(const std::optional<double>& friction, pugi::xml_node geom);

/// One <body> a link, in its place at the joints' start values, and one for each joint that closes
/// a loop. Such a body has part of the mass of the link that it is welded to: MuJoCo softens a
/// constraint by the inverse masses of its two bodies, so that a weld to next to nothing holds
/// nothing.
class MjcfBodies {
 public:
  /// Appends all bodies of the tree to `base`, the robot frame's. `stem` names the files of parts.
  /// The model and the tree must outlive it.
  MjcfBodies(const model::Model& model, const RobotTree& tree, const std::string& stem,
             pugi::xml_node base);

  /// Joints, by index into the tree's, in MuJoCo's order: depth first, as the bodies stand.
  [[nodiscard]] std::vector<int> JointOrder() const;
  /// The parts that the bodies' <include>s refer to; none unless the tree is deep. MuJoCo's reader
  /// takes 100 nested elements a file, but does not count across files.
  [[nodiscard]] std::vector<CompanionFile> Parts() const;

 private:
  /// A <body> of the file, and where it stands among the others.
  struct Body {
    /// Where its joint, mass, geometry and children are appended.
    pugi::xml_node node;
    /// The number of bodies round it in its own file, which the reader of MuJoCo bounds.
    int level = 0;
    /// Index into the tree's joints of the one that moves it; -1: it is fixed to its parent.
    int joint = -1;
    std::vector<int> children;  ///< Indices of bodies, as they stand in the file.
  };
  /// A file of its own for the deeper bodies of a deep tree.
  struct Part {
    /// Relative to the main file's folder.
    std::string path;
    pugi::xml_document document;
  };

  /// The body number bodies_.size(), in `parent` (-1: the base).
  Body& AppendBody(int parent, const std::string& name, int joint, const model::Pose& X_PL);
  /// Goes on in a new part, which is included in `from`; returns the node for the bodies there.
  pugi::xml_node StartPart(pugi::xml_node from);
  /// What is seen of a link, and what touches.
  void AppendGeoms(pugi::xml_node body, const TreeLink& link);
  /// `part` of the link's mass and inertia, 0 to 1.
  void AppendMass(pugi::xml_node body, const TreeLink& link, double part);

  const model::Model& model_;
  LinkSolids solids_;
  const RobotTree& tree_;
  std::string stem_;
  pugi::xml_node base_;
  /// Indices of the bodies that stand in `base_` itself.
  std::vector<int> roots_;
  std::vector<Body> bodies_;  ///< The tree's links, then the bodies of loops.
  /// Parts in the order of their numbers; nodes of bodies refer into their documents.
  std::vector<std::unique_ptr<Part>> parts_;
};

}  // namespace morphbus::emit
