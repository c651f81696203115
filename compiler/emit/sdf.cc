#include "compiler/emit/sdf.h"

#include <fmt/format.h>

#include <pugixml.hpp>

#include "compiler/emit/meshes.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/xml_text.h"

namespace morphbus::emit {
namespace {

using model::JointType;

/// <pose>, by quaternion: roll, pitch and yaw would lose digits.
pugi::xml_node AppendPose(pugi::xml_node node, const model::Pose& X, const std::string& base) {
  pugi::xml_node pose =
      AppendText(node, "pose", Triple(X.translation()) + " " + QuaternionXyzw(X.linear()));
  Set(pose, "rotation_format", "quat_xyzw");
  if (!base.empty()) Set(pose, "relative_to", base);
  return pose;
}

class Writer {
 public:
  Writer(const model::Model& model, const RobotTree& tree, const std::string& stem)
      : model_(model), tree_(tree), stem_(stem) {}

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
    Exported exported;
    exported.text = XmlText(document_);
    exported.companions = MeshFiles(model_, tree_, stem_);
    return exported;
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
    const model::ModuleType& type = model_.module_types[static_cast<size_t>(link.type)];
    const model::LinkMass mass = model::ComputeLinkMass(type, link.link);
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
    const std::string mesh = MeshPath(model_, link, stem_);
    if (mesh.empty()) return;
    for (const char* use : {"visual", "collision"}) {
      pugi::xml_node part = node.append_child(use);
      Set(part, "name", use);
      AppendText(part.append_child("geometry").append_child("mesh"), "uri", mesh);
    }
  }

  pugi::xml_node AppendJoint(const std::string& name, JointType type, int parent, int child) {
    pugi::xml_node node = root_.append_child("joint");
    Set(node, "name", name);
    Set(node, "type", JointTypeName(type));
    AppendText(node, "parent", NameOf(parent));
    AppendText(node, "child", NameOf(child));
    return node;
  }

  /// What holds a link in the tree.
  void AppendHold(const TreeLink& link) {
    if (link.parent < 0) return;
    const int child = static_cast<int>(&link - tree_.links.data());
    if (link.joint < 0) {
      AppendJoint(link.held_by, JointType::kFixed, link.parent, child);
    } else {
      AppendMoving(JointAt(link.joint), link.parent, child);
    }
  }

  void AppendLoop(const TreeLoop& loop) {
    if (loop.joint < 0) {
      AppendJoint(loop.name, JointType::kFixed, loop.from, loop.to);
    } else {
      AppendMoving(JointAt(loop.joint), loop.from, loop.to);
    }
  }

  /// The joint's frame is the child's, moved to the axis, which keeps its place in the child
  /// whatever the joint's value.
  void AppendMoving(const TreeJoint& joint, int parent, int child) {
    pugi::xml_node node = AppendJoint(joint.name, joint.type, parent, child);
    if (joint.type == JointType::kFixed) return;
    AppendText(node, "pose", Triple(joint.origin) + " 0 0 0");
    pugi::xml_node axis = node.append_child("axis");
    AppendText(axis, "xyz", Triple(joint.axis));
    pugi::xml_node limit = axis.append_child("limit");
    if (joint.type != JointType::kContinuous) {
      AppendText(limit, "lower", Number(joint.lower - joint.start));
      AppendText(limit, "upper", Number(joint.upper - joint.start));
    }
    AppendText(limit, "effort", Number(joint.effort));
    AppendText(limit, "velocity", Number(joint.speed));
  }

  const model::Model& model_;
  const RobotTree& tree_;
  const std::string& stem_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

}  // namespace

Exported ToSdf(const model::Model& model, const RobotTree& tree, const std::string& stem) {
  return Writer(model, tree, stem).Write();
}

}  // namespace morphbus::emit
