#include "compiler/emit/sdf.h"

#include <fmt/format.h>

#include <pugixml.hpp>

#include "compiler/emit/link_solids.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/sdf_joint.h"
#include "compiler/emit/xml_text.h"

namespace morphbus::emit {
namespace {

/// <pose>, by quaternion: roll, pitch and yaw would lose digits.
pugi::xml_node AppendPose(pugi::xml_node node, const model::Pose& X, const std::string& base) {
  pugi::xml_node pose =
      AppendText(node, "pose", Triple(X.translation()) + " " + QuaternionXyzw(X.linear()));
  Set(pose, "rotation_format", "quat_xyzw");
  if (!base.empty()) Set(pose, "relative_to", base);
  return pose;
}

/// Names that SDFormat keeps for itself.
bool IsReserved(const std::string& name) {
  const bool marked = name.size() >= 4 && name.compare(0, 2, "__") == 0 &&
                      name.compare(name.size() - 2, 2, "__") == 0;
  return marked || name == "world";
}

class Writer {
 public:
  Writer(const model::Model& model, const RobotTree& tree, const MeshPlace& place)
      : model_(model), solids_(model), tree_(tree), place_(place) {
    RenameReservedLinks("SDF", IsReserved, &tree_, &exported_.warnings);
    RenameReservedJoints("SDF", IsReserved, &tree_, &exported_.warnings);
    if (!IsReserved(tree_.name)) return;
    tree_.name = "m3l" + tree_.name;
    exported_.warnings.push_back(fmt::format(
        "SDF keeps the name {} for itself: the model is called {} there", tree.name, tree_.name));
  }

  Exported Write() {
    StartXml(&document_);
    pugi::xml_node sdf = document_.append_child("sdf");
    Set(sdf, "version", "1.9");
    root_ = sdf.append_child("model");
    Set(root_, "name", tree_.name);
    Comment(root_,
            "SI units, radians. The model frame is the robot frame (x north, y up, z east), which "
            "the pose below turns for worlds whose z is up. Joint values count from the start "
            "values of the robot.");
    model::Pose X_WR = RobotFrameInZUp();
    X_WR.translation().z() = -LowestPoint(model_, tree_);  // It stands on the ground.
    AppendPose(root_, X_WR, "");
    for (const TreeLink& link : tree_.links) AppendLink(link);
    for (const TreeLink& link : tree_.links) AppendHold(link);
    for (const TreeLoop& loop : tree_.loops) AppendLoop(loop);
    exported_.text = XmlText(document_);
    exported_.companions = MeshFiles(model_, tree_, place_);
    return std::move(exported_);
  }

 private:
  const std::string& NameOf(int link) const { return tree_.links[static_cast<size_t>(link)].name; }
  const TreeJoint& JointAt(int joint) const { return tree_.joints[static_cast<size_t>(joint)]; }

  void AppendLink(const TreeLink& link) {
    pugi::xml_node node = root_.append_child("link");
    Set(node, "name", link.name);
    model::Pose X = link.X_PL;
    if (link.joint >= 0) X = X * MotionOf(JointAt(link.joint), JointAt(link.joint).start);
    AppendPose(node, X, link.parent < 0 ? "__model__" : NameOf(link.parent));
    const model::LinkMass& mass = solids_.Mass(link.type, link.link);
    pugi::xml_node inertial = node.append_child("inertial");
    AppendText(inertial, "mass", Number(mass.mass_kg));
    AppendText(inertial, "pose", Triple(mass.p_LoLcm_L) + " 0 0 0");
    pugi::xml_node inertia = inertial.append_child("inertia");
    const char* names = "xyz";
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) {
        AppendText(inertia, fmt::format("i{}{}", names[row], names[column]).c_str(),
                   Number(mass.I_Lcm_L(row, column)));
      }
    }
    const std::string mesh = MeshAddress(model_, link, place_);
    if (mesh.empty()) return;
    for (const char* use : {"visual", "collision"}) {
      pugi::xml_node part = node.append_child(use);
      Set(part, "name", use);
      AppendText(part.append_child("geometry").append_child("mesh"), "uri", mesh);
    }
  }

  /// What holds a link in the tree.
  void AppendHold(const TreeLink& link) {
    if (link.parent >= 0) AppendJoint(link.held_by, link.joint, NameOf(link.parent), link.name);
  }

  void AppendLoop(const TreeLoop& loop) {
    AppendJoint(loop.name, loop.joint, NameOf(loop.from), NameOf(loop.to));
  }

  void AppendJoint(const std::string& name, int joint, const std::string& from,
                   const std::string& to) {
    if (joint < 0) {
      AppendSdfJoint(root_, name, nullptr, from, to, 0.0);
    } else {
      AppendSdfJoint(root_, name, &JointAt(joint), from, to, JointAt(joint).start);
    }
  }

  const model::Model& model_;
  LinkSolids solids_;
  RobotTree tree_;
  const MeshPlace& place_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  Exported exported_;
};

}  // namespace

Exported ToSdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place) {
  return Writer(model, tree, place).Write();
}

}  // namespace morphbus::emit
