#include "compiler/emit/back_ends.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "compiler/emit/left_out.h"
#include "compiler/emit/link_solids.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/scenery.h"
#include "compiler/emit/urdf_cuts.h"
#include "compiler/keywords/xml_text.h"

namespace morphbus::emit {
namespace {

using model::JointType;

/// Appends a <pose>, relative to the frame `base` if that is not empty, by quaternion: roll, pitch
/// and yaw would lose digits.
pugi::xml_node AppendPose(pugi::xml_node node, const model::Pose& X, const std::string& base) {
  pugi::xml_node pose =
      xml::AppendText(node, "pose", Triple(X.translation()) + " " + QuaternionXyzw(X.linear()));
  xml::Set(pose, "rotation_format", "quat_xyzw");
  if (!base.empty()) xml::Set(pose, "relative_to", base);
  return pose;
}

/// Names that SDFormat keeps for itself.
bool IsReserved(const std::string& name) {
  const bool marked = name.size() >= 4 && name.compare(0, 2, "__") == 0 &&
                      name.compare(name.size() - 2, 2, "__") == 0;
  return marked || name == "world";
}

/// The <geometry> of an obstacle; `mesh` is the address of its mesh, if it has one.
void AppendGeometry(pugi::xml_node node, const world::Obstacle& obstacle, const std::string& mesh) {
  const pugi::xml_node geometry = xml::Append(node, "geometry");
  const Eigen::Vector3d& size = obstacle.size;
  switch (obstacle.shape) {
    case world::Shape::kBox:
      xml::AppendText(xml::Append(geometry, "box"), "size", Triple(size));
      return;
    case world::Shape::kCylinder: {
      const pugi::xml_node cylinder = xml::Append(geometry, "cylinder");
      xml::AppendText(cylinder, "radius", Number(size.x()));
      xml::AppendText(cylinder, "length", Number(size.y()));
      return;
    }
    case world::Shape::kSphere:
      xml::AppendText(xml::Append(geometry, "sphere"), "radius", Number(size.x()));
      return;
    case world::Shape::kPlane: {
      const pugi::xml_node plane = xml::Append(geometry, "plane");
      xml::AppendText(plane, "normal", "0 0 1");
      xml::AppendText(plane, "size", Number(size.x()) + " " + Number(size.y()));
      return;
    }
    case world::Shape::kMesh:
      xml::AppendText(xml::Append(geometry, "mesh"), "uri", mesh);
      return;
  }
}

/// How a <collision> grips that has a friction of its own.
void AppendFriction(pugi::xml_node collision, const std::optional<double>& friction) {
  if (!friction) return;
  const pugi::xml_node surface = xml::Append(collision, "surface");
  const pugi::xml_node ode = xml::Append(xml::Append(surface, "friction"), "ode");
  xml::AppendText(ode, "mu", Number(*friction));
  // ODE has a coefficient for each of two directions; here both are one.
  xml::AppendText(ode, "mu2", Number(*friction));
}

/// An obstacle as a static model of one link.
void AppendObstacle(pugi::xml_node world, const world::Obstacle& obstacle,
                    const std::string& mesh) {
  const pugi::xml_node model = xml::Append(world, "model", {{"name", obstacle.name}});
  xml::AppendText(model, "static", "true");
  AppendPose(model, obstacle.X_WO, "");
  const pugi::xml_node link = xml::Append(model, "link", {{"name", "link"}});
  AppendGeometry(xml::Append(link, "visual", {{"name", "visual"}}), obstacle, mesh);
  const pugi::xml_node collision = xml::Append(link, "collision", {{"name", "collision"}});
  AppendGeometry(collision, obstacle, mesh);
  AppendFriction(collision, obstacle.friction);
}

// Writes one <model>: all links, then the joints and connections that hold them. With obstacles it
// stands in a <world> with them.
class SdfWriter {
 public:
  SdfWriter(const model::Model& model, const RobotTree& tree, const MeshPlace& place,
            const std::vector<world::Obstacle>& obstacles)
      : model_(model), solids_(model), tree_(tree), place_(place), obstacles_(obstacles) {
    // SDFormat refuses a file whose links, joints or model have names that it keeps for itself.
    RenameReservedLinks("SDF", IsReserved, &tree_, &exported_.warnings);
    RenameReservedJoints("SDF", IsReserved, &tree_, &exported_.warnings);
    WarnOfLeftOut("SDF", model_, tree_, &exported_.warnings);
    if (!IsReserved(tree_.name)) return;
    tree_.name = "m3l" + tree_.name;
    exported_.warnings.push_back(fmt::format(
        "SDF keeps the name {} for itself: the model is called {} there", tree.name, tree_.name));
  }

  Exported Write() {
    xml::Start(&document_);
    const pugi::xml_node sdf = xml::Append(document_, "sdf", {{"version", "1.9"}});
    root_ =
        xml::Append(obstacles_.empty() ? sdf : AppendWorld(sdf), "model", {{"name", tree_.name}});
    xml::Comment(
        root_,
        "SI units, radians. The model frame is the robot frame (x north, y up, z east), which "
        "the pose below turns for worlds whose z is up. Joint values count from the start "
        "values of the robot.");
    model::Pose X_WR = RobotFrameInZUp();
    X_WR.translation().z() = -LowestPoint(model_, tree_);  // It stands on the ground.
    AppendPose(root_, X_WR, "");
    // SDF holds graphs: every connection is a joint, also those that close loops.
    for (const TreeLink& link : tree_.links) AppendLink(link);
    for (const TreeLink& link : tree_.links) {
      if (link.parent >= 0) AppendJoint(link.held_by, link.joint, NameOf(link.parent), link.name);
    }
    // What closes a loop is a joint like any other.
    for (const TreeLoop& loop : tree_.loops) {
      AppendJoint(loop.name, loop.joint, NameOf(loop.from), NameOf(loop.to));
    }
    exported_.text = xml::Text(document_);
    exported_.companions = MeshFiles(model_, tree_, place_);
    std::ranges::move(obstacle_meshes_, std::back_inserter(exported_.companions));
    return std::move(exported_);
  }

 private:
  /// A <world> with a ground and the obstacles.
  pugi::xml_node AppendWorld(pugi::xml_node sdf) {
    const pugi::xml_node world = xml::Append(sdf, "world", {{"name", tree_.name + "_world"}});
    world::Obstacle ground;
    ground.name = "ground";
    ground.shape = world::Shape::kPlane;
    // The ground reaches everywhere; its size only says how much of it is drawn.
    ground.size = {10, 10, 0};
    std::vector<world::Obstacle> all = {ground};
    const auto taken = [&](const std::string& name) {
      return name == tree_.name || name == ground.name || IsReserved(name);
    };
    std::ranges::copy(InZUp(obstacles_, 0.0, taken), std::back_inserter(all));
    for (const world::Obstacle& obstacle : all) {
      std::string mesh;
      if (obstacle.mesh) {
        obstacle_meshes_.push_back(ObstacleMesh(obstacle, obstacle_meshes_.size() + 1, place_));
        mesh = place_.prefix + obstacle_meshes_.back().path;
      }
      AppendObstacle(world, obstacle, mesh);
    }
    return world;
  }

  /// Name of the link of this index in the tree.
  const std::string& NameOf(int link) const { return tree_.links[link].name; }

  /// A <link> with its mass and, if it has a hull, its mesh.
  void AppendLink(const TreeLink& link) {
    // A link stands where the joints' start values place it, given from the link that holds it.
    const pugi::xml_node node = xml::Append(root_, "link", {{"name", link.name}});
    const model::Pose X = StartInParent(tree_, link.X_PL, link.joint);
    AppendPose(node, X, link.parent < 0 ? "__model__" : NameOf(link.parent));
    const model::LinkMass& mass = solids_.Mass(link.type, link.link);
    const pugi::xml_node inertial = xml::Append(node, "inertial");
    xml::AppendText(inertial, "mass", Number(mass.mass_kg));
    // The inertia below is about the centre of mass, in the link's directions.
    xml::AppendText(inertial, "pose", Triple(mass.p_LoLcm_L) + " 0 0 0");
    const pugi::xml_node inertia = xml::Append(inertial, "inertia");
    for (const auto& [name, value] : InertiaEntries(mass.I_Lcm_L)) {
      xml::AppendText(inertia, name, value);
    }
    // What is seen and what collides are the same convex parts, unless the link looks otherwise.
    const std::vector<LookMesh>& looks = solids_.Looks(link.type, link.link);
    for (size_t i = 0; i < looks.size(); ++i) {
      const pugi::xml_node part = xml::Append(
          node, "visual", {{"name", looks.size() == 1 ? "visual" : PartName("visual", i + 1)}});
      xml::AppendText(xml::Append(xml::Append(part, "geometry"), "mesh"), "uri",
                      LookAddress(looks[i], place_));
      if (!looks[i].color) continue;
      const pugi::xml_node material = xml::Append(part, "material");
      for (const char* light : {"ambient", "diffuse"}) {
        xml::AppendText(material, light, Rgba(*looks[i].color));
      }
    }
    const std::vector<std::string> meshes = MeshAddresses(model_, link, place_);
    for (size_t i = 0; i < meshes.size(); ++i) {
      for (const char* use : {"visual", "collision"}) {
        if (!looks.empty() && use == std::string_view("visual")) continue;
        const std::string name = meshes.size() == 1 ? use : PartName(use, i + 1);
        const pugi::xml_node part = xml::Append(node, use, {{"name", name}});
        xml::AppendText(xml::Append(xml::Append(part, "geometry"), "mesh"), "uri", meshes[i]);
        if (use == std::string_view("collision")) {
          AppendFriction(part, LinkOf(model_, link).friction);
        }
      }
    }
  }

  /// The joint or connection by which the link `from` holds the link `to`.
  void AppendJoint(const std::string& name, int joint, const std::string& from,
                   const std::string& to) {
    // A connection is a fixed joint. Joint values of SDF count from the robot's start values.
    const TreeJoint* of = joint < 0 ? nullptr : &tree_.joints[joint];
    AppendSdfJoint(root_, name, of, from, to, of == nullptr ? 0.0 : of->start);
  }

  const model::Model& model_;
  LinkSolids solids_;
  RobotTree tree_;
  const MeshPlace& place_;
  const std::vector<world::Obstacle>& obstacles_;
  std::vector<CompanionFile> obstacle_meshes_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  Exported exported_;
};

}  // namespace

void AppendSdfJoint(pugi::xml_node parent, const std::string& name, const TreeJoint* joint,
                    const std::string& from, const std::string& to, double at,
                    const model::Pose& X_CL) {
  const JointType type = joint == nullptr ? JointType::kFixed : joint->type;
  const pugi::xml_node node =
      xml::Append(parent, "joint", {{"name", name}, {"type", model::JointTypeName(type)}});
  xml::AppendText(node, "parent", from);
  xml::AppendText(node, "child", to);
  if (type == JointType::kFixed) return;
  // The joint's frame is the child's, moved to the axis, which keeps its place in the child
  // whatever the joint's value.
  xml::AppendText(node, "pose", Triple(X_CL * joint->origin) + " 0 0 0");
  const pugi::xml_node axis = xml::Append(node, "axis");
  xml::AppendText(axis, "xyz", Triple(X_CL.linear() * joint->axis));
  // Joint values of SDF are 0 where the file places the links, which may be other than M3L's 0.
  const pugi::xml_node limit = xml::Append(axis, "limit");
  if (type != JointType::kContinuous) {
    xml::AppendText(limit, "lower", Number(joint->lower - at));
    xml::AppendText(limit, "upper", Number(joint->upper - at));
  }
  xml::AppendText(limit, "effort", Number(joint->effort));
  xml::AppendText(limit, "velocity", Number(joint->speed));
}

Exported ToSdf(const model::Model& model, const RobotTree& tree, const MeshPlace& place,
               const std::vector<world::Obstacle>& obstacles) {
  return SdfWriter(model, tree, place, obstacles).Write();
}

}  // namespace morphbus::emit
