#include "compiler/emit/back_ends.h"

#include <fmt/format.h>

#include <pugixml.hpp>
#include <utility>
#include <vector>

#include "compiler/emit/left_out.h"
#include "compiler/emit/link_solids.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/urdf_cuts.h"
#include "compiler/keywords/xml_text.h"

namespace morphbus::emit {
namespace {

using model::JointType;

constexpr const char* kWorld = "world";

/// Appends an <origin>: position in metres, and roll, pitch and yaw in radians.
void AppendOrigin(pugi::xml_node node, const model::Pose& X) {
  xml::Append(node, "origin",
              {{"xyz", Triple(X.translation())}, {"rpy", Triple(RollPitchYaw(X.linear()))}});
}

// Writes one <robot>: a tree of links, and comments and warnings on what the tree lacks.
class UrdfWriter {
 public:
  UrdfWriter(const model::Model& model, const RobotTree& tree, const MeshPlace& place)
      : model_(model), solids_(model), tree_(tree), place_(place) {
    // Gazebo and MuJoCo take a link of this name for the world.
    RenameReservedLinks(
        "URDF", [](const std::string& name) { return name == "world"; }, &tree_,
        &exported_.warnings);
    WarnOfLeftOut("URDF", model_, tree_, &exported_.warnings);
    base_ = FreeName(tree_, "robot_frame");
  }

  Exported Write() {
    xml::Start(&document_);
    root_ = xml::Append(document_, "robot", {{"name", tree_.name}});
    xml::Comment(root_,
                 fmt::format("SI units, radians. {} has z up (x north, y west); {} is the robot "
                             "frame: x north, y up, z east.",
                             kWorld, base_));
    AppendMuJoCo();
    WarnOfStart();
    for (const TreeLoop& loop : tree_.loops) CutLoop(loop);
    for (const TreeLink& link : tree_.links) WarnIfLocked(link);
    // URDF knows one root link, whose z is up; below it stands the robot frame, whose y is up.
    AppendNamedLink(kWorld);
    AppendNamedLink(base_);
    AppendJoint(std::string(kWorld) + "-" + base_, "fixed", kWorld, base_, RobotFrameInZUp());
    for (const TreeLink& link : tree_.links) {
      AppendJoints(link);
      AppendLink(link);
    }
    // Gazebo closes the loops again by joints of its own, which other readers pass over.
    AppendGazeboJoints(tree_, CarryingLinks(), root_);
    exported_.text = xml::Text(document_);
    exported_.companions = MeshFiles(model_, tree_, place_);
    // Also where nothing is cut, so that no list of an earlier export is taken for this one's.
    exported_.companions.push_back({place_.stem + "_cuts.json", CutsJson(tree_)});
    return std::move(exported_);
  }

 private:
  /// A <link> without anything in it.
  pugi::xml_node AppendNamedLink(const std::string& name) {
    return xml::Append(root_, "link", {{"name", name}});
  }

  /// Without it MuJoCo would look for meshes in the file's own folder, merge links that a fixed
  /// joint holds, and lose their names.
  void AppendMuJoCo() {
    xml::Append(xml::Append(root_, "mujoco"), "compiler",
                {{"strippath", "false"}, {"fusestatic", "false"}, {"discardvisual", "true"}});
  }

  void WarnOfStart() {
    // Readers of URDF start at joint values 0, which may be another posture than the robot's.
    std::vector<std::string> starts;
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.start != 0.0) starts.push_back(joint.name + "=" + Number(joint.start));
    }
    if (starts.empty()) return;
    exported_.warnings.push_back(fmt::format(
        "URDF holds no start values: joint values are 0 unless the user of the file sets "
        "them; {} of {} joints start elsewhere, as a comment in the file says",
        starts.size(), tree_.joints.size()));
    xml::Comment(root_,
                 fmt::format("Start values (rad or m), others 0: {}.", fmt::join(starts, " ")));
  }

  /// Says in a warning and in a comment of the file which loop is open.
  void CutLoop(const TreeLoop& loop) {
    // The message names what is cut and what that costs; the comment in the file also has the pose.
    const std::string& from = tree_.links[loop.from].name;
    const std::string& to = tree_.links[loop.to].name;
    std::string what;
    // Cuts without loss are told too, as the file lacks what the model has.
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
    xml::Comment(
        root_, fmt::format("Opens a loop: {}. In the robot {} holds {} at xyz \"{}\" rpy \"{}\"{}.",
                           what, from, to, Triple(loop.X_FT.translation()),
                           Triple(RollPitchYaw(loop.X_FT.linear())),
                           loop.joint < 0 ? "" : " at joint value 0"));
  }

  /// The loop that locked the joint is open here.
  void WarnIfLocked(const TreeLink& link) {
    if (link.joint < 0 || !tree_.joints[link.joint].locked) return;
    const std::string what =
        fmt::format("{} can move here, but not in the robot, whose loops lock it",
                    tree_.joints[link.joint].name);
    exported_.warnings.push_back("URDF holds trees only: " + what);
    xml::Comment(root_, what + ".");
  }

  /// A <link> with its mass and, if it has a hull, its mesh.
  void AppendLink(const TreeLink& link) {
    pugi::xml_node node = AppendNamedLink(link.name);
    const model::LinkMass& mass = solids_.Mass(link.type, link.link);
    const pugi::xml_node inertial = xml::Append(node, "inertial");
    xml::Append(inertial, "origin", {{"xyz", Triple(mass.p_LoLcm_L)}});
    xml::Append(inertial, "mass", {{"value", Number(mass.mass_kg)}});
    const pugi::xml_node inertia = xml::Append(inertial, "inertia");
    for (const auto& [name, value] : InertiaEntries(mass.I_Lcm_L)) xml::Set(inertia, name, value);
    // What is seen and what collides are the same convex parts, unless the link looks otherwise.
    const std::vector<LookMesh>& looks = solids_.Looks(link.type, link.link);
    for (const LookMesh& look : looks) {
      const pugi::xml_node visual = xml::Append(node, "visual");
      xml::Append(xml::Append(visual, "geometry"), "mesh",
                  {{"filename", LookAddress(look, place_)}});
      if (!look.color) continue;
      const pugi::xml_node material =
          xml::Append(visual, "material", {{"name", CssColor(*look.color)}});
      xml::Append(material, "color", {{"rgba", Rgba(*look.color)}});
    }
    for (const std::string& mesh : MeshAddresses(model_, link, place_)) {
      for (const char* use : {"visual", "collision"}) {
        if (!looks.empty() && use == std::string_view("visual")) continue;
        xml::Append(xml::Append(xml::Append(node, use), "geometry"), "mesh", {{"filename", mesh}});
      }
    }
    if (const std::optional<double>& friction = LinkOf(model_, link).friction) {
      // URDF knows no friction; this is Gazebo's addition to it, with one number a direction.
      const pugi::xml_node gazebo = xml::Append(root_, "gazebo", {{"reference", link.name}});
      for (const char* mu : {"mu1", "mu2"}) xml::AppendText(gazebo, mu, Number(*friction));
    }
  }

  // X is the pose of the joint, and so of the child link at joint value 0, in the parent.
  pugi::xml_node AppendJoint(const std::string& name, const char* type, const std::string& parent,
                             const std::string& child, const model::Pose& X) {
    const pugi::xml_node node = xml::Append(root_, "joint", {{"name", name}, {"type", type}});
    xml::Append(node, "parent", {{"link", parent}});
    xml::Append(node, "child", {{"link", child}});
    AppendOrigin(node, X);
    return node;
  }

  /// The joint or connection that holds the link, by one <joint> or, over a link on the axis, by
  /// two.
  void AppendJoints(const TreeLink& link) {
    // The link hangs from another link, or, if it is a root, from the robot frame.
    const std::string& parent = link.parent < 0 ? base_ : tree_.links[link.parent].name;
    if (link.joint < 0) {
      AppendJoint(link.held_by.empty() ? base_ + "-" + link.name : link.held_by, "fixed", parent,
                  link.name, link.X_PL);
      return;
    }
    const TreeJoint& joint = tree_.joints[link.joint];
    // A joint of URDF turns about its child's origin. Where the axis misses that, a link without
    // mass stands on the axis, and the real link hangs from it.
    const bool needs_axis = AxisIsOffOrigin(joint);
    const std::string turned = needs_axis ? AxisLink(link) : link.name;
    model::Pose X_PJ = model::Pose::Identity();
    if (needs_axis) X_PJ.translation() = joint.origin;
    pugi::xml_node node =
        AppendJoint(joint.name, model::JointTypeName(joint.type), parent, turned, X_PJ);
    if (joint.type != JointType::kFixed) AppendLimits(node, joint);
    if (!needs_axis) return;
    AppendNamedLink(turned);
    AppendJoint(turned + "-" + link.name, "fixed", turned, link.name, X_PJ.inverse());
  }

  // The link without mass that stands on the axis of a joint.
  static std::string AxisLink(const TreeLink& link) { return link.name + ".axis"; }

  /// For each link the nearest one above it, itself included, that no fixed joint holds.
  std::vector<CarryingLink> CarryingLinks() const {
    // Gazebo merges links that fixed joints hold, so its joints must name the links that remain.
    std::vector<CarryingLink> carrying;
    for (const TreeLink& link : tree_.links) {
      const TreeJoint* joint = link.joint < 0 ? nullptr : &tree_.joints[link.joint];
      if (joint == nullptr || joint->type == JointType::kFixed) {
        CarryingLink carrier{base_, model::Pose::Identity()};
        if (link.parent >= 0) carrier = carrying[link.parent];
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

  // Continuous joints have no limits but those of effort and speed.
  static void AppendLimits(pugi::xml_node node, const TreeJoint& joint) {
    xml::Append(node, "axis", {{"xyz", Triple(joint.axis)}});
    const pugi::xml_node limit = xml::Append(node, "limit");
    if (joint.type != JointType::kContinuous) {
      xml::Set(limit, "lower", Number(joint.lower));
      xml::Set(limit, "upper", Number(joint.upper));
    }
    xml::Set(limit, "effort", Number(joint.effort));
    xml::Set(limit, "velocity", Number(joint.speed));
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
  return UrdfWriter(model, tree, place).Write();
}

}  // namespace morphbus::emit
