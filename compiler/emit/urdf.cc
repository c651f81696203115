#include "compiler/emit/urdf.h"

#include <fmt/format.h>

#include <pugixml.hpp>
#include <utility>
#include <vector>

#include "compiler/emit/link_solids.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/urdf_cuts.h"
#include "compiler/emit/xml_text.h"

namespace morphbus::emit {
namespace {

using model::JointType;

constexpr const char* kWorld = "world";

void AppendOrigin(pugi::xml_node node, const model::Pose& X) {
  pugi::xml_node origin = node.append_child("origin");
  Set(origin, "xyz", Triple(X.translation()));
  Set(origin, "rpy", Triple(RollPitchYaw(X.linear())));
}

class Writer {
 public:
  Writer(const model::Model& model, const RobotTree& tree, const MeshPlace& place)
      : model_(model), solids_(model), tree_(tree), place_(place) {
    // Gazebo and MuJoCo take a link of this name for the world.
    RenameReservedLinks(
        "URDF", [](const std::string& name) { return name == "world"; }, &tree_,
        &exported_.warnings);
    base_ = FreeName(tree_, "robot_frame");
  }

  Exported Write() {
    StartXml(&document_);
    root_ = document_.append_child("robot");
    Set(root_, "name", tree_.name);
    Comment(root_, fmt::format("SI units, radians. {} has z up (x north, y west); {} is the robot "
                               "frame: x north, y up, z east.",
                               kWorld, base_));
    AppendMuJoCo();
    WarnOfStart();
    for (const TreeLoop& loop : tree_.loops) CutLoop(loop);
    for (const TreeLink& link : tree_.links) WarnIfLocked(link);
    NameLink(root_, kWorld);
    NameLink(root_, base_);
    AppendJoint(std::string(kWorld) + "-" + base_, "fixed", kWorld, base_, RobotFrameInZUp());
    for (const TreeLink& link : tree_.links) {
      AppendJoints(link);
      AppendLink(link);
    }
    AppendGazeboJoints(tree_, CarryingLinks(), root_);
    exported_.text = XmlText(document_);
    exported_.companions = MeshFiles(model_, tree_, place_);
    // Also where nothing is cut, so that no list of an earlier export is taken for this one's.
    exported_.companions.push_back({place_.stem + "_cuts.json", CutsJson(tree_)});
    return std::move(exported_);
  }

 private:
  static pugi::xml_node NameLink(pugi::xml_node robot, const std::string& name) {
    pugi::xml_node node = robot.append_child("link");
    Set(node, "name", name);
    return node;
  }

  /// Without it MuJoCo would look for meshes in the file's own folder, merge links that a fixed
  /// joint holds, and lose their names.
  void AppendMuJoCo() {
    pugi::xml_node compiler = root_.append_child("mujoco").append_child("compiler");
    Set(compiler, "strippath", "false");
    Set(compiler, "fusestatic", "false");
    Set(compiler, "discardvisual", "true");
  }

  void WarnOfStart() {
    std::vector<std::string> starts;
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.start != 0.0) starts.push_back(joint.name + "=" + Number(joint.start));
    }
    if (starts.empty()) return;
    exported_.warnings.push_back(fmt::format(
        "URDF holds no start values: joint values are 0 unless the user of the file sets "
        "them; {} of {} joints start elsewhere, as a comment in the file says",
        starts.size(), tree_.joints.size()));
    Comment(root_, fmt::format("Start values (rad or m), others 0: {}.", fmt::join(starts, " ")));
  }

  void CutLoop(const TreeLoop& loop) {
    const std::string& from = tree_.links[static_cast<size_t>(loop.from)].name;
    const std::string& to = tree_.links[static_cast<size_t>(loop.to)].name;
    std::string what;
    switch (loop.loss) {
      case TreeLoop::Loss::kNothing:
        what = fmt::format("{} is left out; nothing is lost: other connections hold {} and {}",
                           loop.name, from, to);
        break;
      case TreeLoop::Loss::kLockedJoint:
        what = fmt::format("{}, which the robot's loops lock, is cut; {} no longer holds {}",
                           loop.name, from, to);
        break;
      case TreeLoop::Loss::kLoop:
        what = fmt::format("{} is cut; {} no longer holds {}", loop.name, from, to);
    }
    exported_.warnings.push_back("URDF holds trees only: " + what);
    Comment(root_,
            fmt::format("Opens a loop: {}. In the robot {} holds {} at xyz \"{}\" rpy \"{}\"{}.",
                        what, from, to, Triple(loop.X_FT.translation()),
                        Triple(RollPitchYaw(loop.X_FT.linear())),
                        loop.joint < 0 ? "" : " at joint value 0"));
  }

  /// The loop that locked the joint is open here.
  void WarnIfLocked(const TreeLink& link) {
    if (link.joint < 0 || !tree_.joints[static_cast<size_t>(link.joint)].locked) return;
    const std::string what =
        fmt::format("{} can move here, but not in the robot, whose loops lock it",
                    tree_.joints[static_cast<size_t>(link.joint)].name);
    exported_.warnings.push_back("URDF holds trees only: " + what);
    Comment(root_, what + ".");
  }

  void AppendLink(const TreeLink& link) {
    pugi::xml_node node = NameLink(root_, link.name);
    const model::LinkMass& mass = solids_.Mass(link.type, link.link);
    pugi::xml_node inertial = node.append_child("inertial");
    Set(inertial.append_child("origin"), "xyz", Triple(mass.p_LoLcm_L));
    Set(inertial.append_child("mass"), "value", Number(mass.mass_kg));
    AppendInertia(inertial, mass.I_Lcm_L);
    const std::string mesh = MeshAddress(model_, link, place_);
    if (mesh.empty()) return;
    for (const char* use : {"visual", "collision"}) {
      pugi::xml_node geometry = node.append_child(use).append_child("geometry");
      Set(geometry.append_child("mesh"), "filename", mesh);
    }
  }

  static void AppendInertia(pugi::xml_node inertial, const Eigen::Matrix3d& I) {
    pugi::xml_node node = inertial.append_child("inertia");
    const char* names = "xyz";
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) {
        Set(node, fmt::format("i{}{}", names[row], names[column]), Number(I(row, column)));
      }
    }
  }

  pugi::xml_node AppendJoint(const std::string& name, const char* type, const std::string& parent,
                             const std::string& child, const model::Pose& X) {
    pugi::xml_node node = root_.append_child("joint");
    Set(node, "name", name);
    Set(node, "type", type);
    Set(node.append_child("parent"), "link", parent);
    Set(node.append_child("child"), "link", child);
    AppendOrigin(node, X);
    return node;
  }

  void AppendJoints(const TreeLink& link) {
    const std::string& parent =
        link.parent < 0 ? base_ : tree_.links[static_cast<size_t>(link.parent)].name;
    if (link.joint < 0) {
      AppendJoint(link.held_by.empty() ? base_ + "-" + link.name : link.held_by, "fixed", parent,
                  link.name, link.X_PL);
      return;
    }
    const TreeJoint& joint = tree_.joints[static_cast<size_t>(link.joint)];
    const bool needs_axis = AxisIsOffOrigin(joint);
    const std::string turned = needs_axis ? AxisLink(link) : link.name;
    model::Pose X_PJ = model::Pose::Identity();
    if (needs_axis) X_PJ.translation() = joint.origin;
    pugi::xml_node node = AppendJoint(joint.name, JointTypeName(joint.type), parent, turned, X_PJ);
    if (joint.type != JointType::kFixed) AppendLimits(node, joint);
    if (!needs_axis) return;
    NameLink(root_, turned);
    AppendJoint(turned + "-" + link.name, "fixed", turned, link.name, X_PJ.inverse());
  }

  static std::string AxisLink(const TreeLink& link) { return link.name + ".axis"; }

  /// For each link the nearest one above it, itself included, that no fixed joint holds.
  std::vector<CarryingLink> CarryingLinks() const {
    std::vector<CarryingLink> carrying;
    for (const TreeLink& link : tree_.links) {
      const TreeJoint* joint =
          link.joint < 0 ? nullptr : &tree_.joints[static_cast<size_t>(link.joint)];
      if (joint == nullptr || joint->type == JointType::kFixed) {
        CarryingLink carrier{base_, model::Pose::Identity()};
        if (link.parent >= 0) carrier = carrying[static_cast<size_t>(link.parent)];
        carrier.X_CL = carrier.X_CL * link.X_PL;
        carrying.push_back(std::move(carrier));
      } else if (AxisIsOffOrigin(*joint)) {
        carrying.push_back({AxisLink(link), model::Pose(Eigen::Translation3d(-joint->origin))});
      } else {
        carrying.push_back({link.name, model::Pose::Identity()});
      }
    }
    return carrying;
  }

  static void AppendLimits(pugi::xml_node node, const TreeJoint& joint) {
    Set(node.append_child("axis"), "xyz", Triple(joint.axis));
    pugi::xml_node limit = node.append_child("limit");
    if (joint.type != JointType::kContinuous) {
      Set(limit, "lower", Number(joint.lower));
      Set(limit, "upper", Number(joint.upper));
    }
    Set(limit, "effort", Number(joint.effort));
    Set(limit, "velocity", Number(joint.speed));
  }

  const model::Model& model_;
  LinkSolids solids_;
  RobotTree tree_;
  const MeshPlace& place_;
  std::string base_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  Exported exported_;
};

}  // namespace

Exported ToUrdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place) {
  return Writer(model, tree, place).Write();
}

}  // namespace morphbus::emit
