#include "compiler/emit/back_ends.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <pugixml.hpp>
#include <set>
#include <utility>
#include <vector>

#include "compiler/emit/left_out.h"
#include "compiler/emit/meshes.h"
#include "compiler/emit/mjcf_bodies.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/scenery.h"
#include "compiler/emit/triangle_plates.h"
#include "compiler/keywords/xml_text.h"
#include "compiler/model/convex_hull.h"

namespace morphbus::emit {
namespace {

using model::JointType;

constexpr double kFullForcePart = 0.01;   // Of a joint's range: the error at full force.
constexpr double kLeastSettling = 12e-3;  // s; MuJoCo steps by 2 ms.
constexpr double kWeldSettling = 5e-3;    // s
constexpr size_t kFreeValues = 7;         // In qpos, of the free joint.
constexpr size_t kMostKeyframeValues = 1000;

/// The error (rad or m) at which a position servo gives its full force. Against the joint's damping
/// it settles with the time constant error/speed; four times the drive's, so that it does not
/// swing.
double FullForceError(const TreeJoint& joint) {
  static_assert(kLeastSettling >= 4.0 * kMjcfRunUp);
  // A hundredth of the range, but never so stiff that it would swing; continuous joints have no
  // range.
  const double part =
      joint.type == JointType::kContinuous ? 0.0 : kFullForcePart * (joint.upper - joint.lower);
  return std::max(part, kLeastSettling * joint.speed);
}

/// MuJoCo's type of a shape and its sizes, which are halves of sides and lengths.
std::pair<std::string, std::string> MjcfShape(const world::Obstacle& obstacle) {
  const Eigen::Vector3d& size = obstacle.size;
  switch (obstacle.shape) {
    case world::Shape::kBox:
      return {"box", Triple(0.5 * size)};
    case world::Shape::kCylinder:
      return {"cylinder", Number(size.x()) + " " + Number(0.5 * size.y())};
    case world::Shape::kSphere:
      return {"sphere", Number(size.x())};
    case world::Shape::kPlane:
    case world::Shape::kMesh:  // Made of plates.
      break;
  }
  // The third number is the distance of the lines that are drawn on it.
  return {"plane", Number(0.5 * size.x()) + " " + Number(0.5 * size.y()) + " 0.1"};
}

/// A mesh by its corners, of which MuJoCo takes the hull.
template <typename Points>
pugi::xml_node AppendMesh(pugi::xml_node asset, const std::string& name, const Points& corners) {
  std::string text;
  for (const Eigen::Vector3d& p : corners) text += (text.empty() ? "" : "  ") + Triple(p);
  return xml::Append(asset, "mesh", {{"name", name}, {"vertex", text}});
}

/// Writes one MJCF file with the parts that belong to it. Write is called once.
class MjcfWriter {
 public:
  MjcfWriter(const model::Model& model, const RobotTree& tree, const std::string& stem,
             const std::vector<world::Obstacle>& obstacles)
      : model_(model), tree_(tree), stem_(stem), obstacles_(obstacles) {
    // A link must not have the name of MuJoCo's own body.
    RenameReservedLinks(
        "MJCF", [](const std::string& name) { return name == "world"; }, &tree_,
        &exported_.warnings);
    WarnOfLeftOut("MJCF", model_, tree_, &exported_.warnings);
    base_ = FreeName(tree_, "robot_frame");
  }

  Exported Write() {
    xml::Start(&document_);
    root_ = xml::Append(document_, "mujoco", {{"model", tree_.name}});
    xml::Comment(root_, "SI units, radians. The world has z up (x north, y west); " + base_ +
                            " is the robot frame: x north, y up, z east.");
    xml::Append(root_, "compiler", {{"angle", "radian"}, {"autolimits", "true"}});
    xml::Append(root_, "option", {{"gravity", "0 0 -9.81"}});
    AppendSizes();
    AppendMeshes();
    pugi::xml_node world = root_.append_child("worldbody");
    AppendFloor(world);
    AppendObstacles(world);
    // What follows refers to bodies and joints by name, so the bodies come first.
    const MjcfBodies bodies(model_, tree_, stem_, AppendBase(world));
    AppendExcludes();
    AppendWelds();
    AppendActuators();
    AppendStart(bodies.JointOrder());
    exported_.text = xml::Text(document_);
    exported_.companions = bodies.Parts();
    exported_.parts_folder = MjcfPartsFolder(stem_);
    return std::move(exported_);
  }

 private:
  /// Room for the contacts of a robot that lies on the floor; without it MuJoCo 2 has room for 100.
  void AppendSizes() {
    constexpr size_t kDefault = 100;
    // With 4 a chain of 16 Molecubes found no room. Where the ground is made of plates a link lies
    // on several.
    const bool plates =
        std::ranges::any_of(obstacles_, [](const auto& o) { return o.mesh != nullptr; });
    const size_t per_link = plates ? 32 : 8;
    constexpr size_t kOtherRowsPerLink = 8;
    constexpr size_t kMost = 2000;  // MuJoCo's memory grows by this times the joints.
    constexpr size_t kRowsOfAContact = 4;
    const size_t contacts = std::min(per_link * tree_.links.size(), kMost);
    // Up to its default MuJoCo has enough room by itself.
    if (contacts <= kDefault) return;
    const size_t rows = kRowsOfAContact * contacts + kOtherRowsPerLink * tree_.links.size();
    xml::Append(root_, "size",
                {{"nconmax", std::to_string(contacts)}, {"njmax", std::to_string(rows)}});
  }

  /// The meshes of all links.
  void AppendMeshes() {
    const std::map<std::string, model::ConvexHull> meshes = MeshesOf(model_, tree_);
    const std::map<std::string, LookMesh> looks = LooksOf(model_, tree_);
    if (meshes.empty() && looks.empty()) return;
    const pugi::xml_node asset = xml::Append(root_, "asset");
    for (const auto& [name, hull] : meshes) AppendMesh(asset, name, hull.vertices);
    for (const auto& [name, look] : looks) {
      std::string faces;
      for (const std::array<int, 3>& t : look.triangles) {
        faces += fmt::format("{}{} {} {}", faces.empty() ? "" : "  ", t[0], t[1], t[2]);
      }
      xml::Set(AppendMesh(asset, name, look.points), "face", faces);
    }
  }

  /// The body of the robot frame, turned for a world whose z is up and free to move.
  pugi::xml_node AppendBase(pugi::xml_node world) {
    const model::Pose X_WR = RobotFrameInZUp();
    const pugi::xml_node base = xml::Append(world, "body",
                                            {{"name", base_},
                                             {"pos", Triple(X_WR.translation())},
                                             {"quat", QuaternionWxyz(X_WR.linear())}});
    xml::Append(base, "freejoint", {{"name", FreeName(tree_, base_ + ".free")}});
    return base;
  }

  /// A light, and a floor below the robot as it stands at the start.
  void AppendFloor(pugi::xml_node world) {
    const double height = LowestPoint(model_, tree_) - kFloorClearance;
    xml::Append(world, "light", {{"pos", "0 0 3"}, {"dir", "0 0 -1"}});
    xml::Append(world, "geom",
                {{"name", FreeName(tree_, "floor")},
                 {"type", "plane"},
                 {"size", "0 0 0.1"},
                 {"pos", Triple({0.0, 0.0, height})}});
  }

  /// Obstacles as geoms of the world, each under its own name but for meshes.
  void AppendObstacles(pugi::xml_node world) {
    const double floor = LowestPoint(model_, tree_) - kFloorClearance;
    // Geoms are called after links, and the ground has its name.
    const std::string ground = FreeName(tree_, "floor");
    const auto taken = [&](const std::string& name) {
      return name == ground || std::ranges::any_of(tree_.links, [&](const TreeLink& link) {
               return name.starts_with(link.name);
             });
    };
    for (const world::Obstacle& obstacle : InZUp(obstacles_, floor, taken)) {
      if (obstacle.mesh) {
        AppendPlates(obstacle, world);
        continue;
      }
      const auto [type, size] = MjcfShape(obstacle);
      AppendGeom(obstacle, {{"name", obstacle.name}, {"type", type}, {"size", size}}, world);
    }
  }

  /// A geom where the obstacle is, with its friction.
  static void AppendGeom(const world::Obstacle& obstacle,
                         const std::vector<std::pair<std::string, std::string>>& what,
                         pugi::xml_node world) {
    const pugi::xml_node geom = xml::Append(world, "geom");
    for (const auto& [name, value] : what) xml::Set(geom, name.c_str(), value);
    xml::Set(geom, "pos", Triple(obstacle.X_WO.translation()));
    xml::Set(geom, "quat", QuaternionWxyz(obstacle.X_WO.linear()));
    AppendMjcfFriction(obstacle.friction, geom);
  }

  /// The triangles of a mesh or height map, "NAME/1" and so on: no other name has a slash.
  void AppendPlates(const world::Obstacle& obstacle, pugi::xml_node world) {
    const pugi::xml_node asset = root_.insert_child_before("asset", world);
    int number = 0;
    for (const Plate& plate : PlatesOf(*obstacle.mesh)) {
      const std::string name = obstacle.name + "/" + std::to_string(++number);
      AppendMesh(asset, name, plate);
      AppendGeom(obstacle, {{"name", name}, {"type", "mesh"}, {"mesh", name}}, world);
    }
  }

  /// Links that touch by construction: those one or two joints or connections apart. (MuJoCo leaves
  /// out only parent and child.)
  void AppendExcludes() {
    // Of each link, those one step away.
    std::vector<std::set<int>> near(tree_.links.size());
    const auto join = [&](int a, int b) {
      near[a].insert(b);
      near[b].insert(a);
    };
    for (size_t i = 0; i < tree_.links.size(); ++i) {
      if (tree_.links[i].parent >= 0) join(static_cast<int>(i), tree_.links[i].parent);
    }
    for (const TreeLoop& loop : tree_.loops) join(loop.from, loop.to);
    // Each link and those up to two steps away, every pair once.
    pugi::xml_node contact = root_.append_child("contact");
    for (size_t i = 0; i < near.size(); ++i) {
      std::set<int> excluded = near[i];
      for (const int j : near[i]) {
        const std::set<int>& beyond = near[j];
        excluded.insert(beyond.begin(), beyond.end());
      }
      for (const int j : excluded) {
        if (j <= static_cast<int>(i)) continue;
        xml::Append(contact, "exclude",
                    {{"body1", tree_.links[i].name}, {"body2", tree_.links[j].name}});
      }
    }
  }

  /// A weld for each loop, always with relpose: without it MuJoCo would keep whatever gap there is
  /// at qpos 0.
  void AppendWelds() {
    if (tree_.loops.empty()) return;
    pugi::xml_node equality = root_.append_child("equality");
    for (const TreeLoop& loop : tree_.loops) {
      const pugi::xml_node weld = xml::Append(equality, "weld", {{"name", loop.name}});
      xml::Set(weld, "body1", loop.joint >= 0 ? MjcfLoopBody(loop) : tree_.links[loop.from].name);
      xml::Set(weld, "body2", tree_.links[loop.to].name);
      xml::Set(weld, "solref", Number(kWeldSettling) + " 1");
      xml::Set(weld, "relpose",
               Triple(loop.X_FT.translation()) + " " + QuaternionWxyz(loop.X_FT.linear()));
    }
  }

  /// A position servo for each joint that moves, as strong as its motor.
  void AppendActuators() {
    pugi::xml_node actuator;
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.type == JointType::kFixed) continue;
      // A robot without joints that move has no such element.
      if (!actuator) actuator = root_.append_child("actuator");
      const pugi::xml_node position =
          xml::Append(actuator, "position",
                      {{"name", joint.name},
                       {"joint", joint.name},
                       {"kp", Number(joint.effort / FullForceError(joint))}});
      if (joint.type != JointType::kContinuous) {
        xml::Set(position, "ctrlrange", Number(joint.lower) + " " + Number(joint.upper));
      }
      xml::Set(position, "forcerange", Number(-joint.effort) + " " + Number(joint.effort));
    }
  }

  /// The keyframe "start". `order` lists the joints as MuJoCo numbers them.
  void AppendStart(const std::vector<int>& order) {
    if (order.size() + kFreeValues > kMostKeyframeValues) {
      exported_.warnings.push_back(fmt::format(
          "MuJoCo reads keyframes of at most {} values, this robot has {}: the keyframe start is "
          "left out; the file opens at the start values, but controls are 0 until they are set",
          kMostKeyframeValues, order.size() + kFreeValues));
      return;
    }
    // The values of the free joint, which places the robot frame, then those of the joints.
    const model::Pose X_WR = RobotFrameInZUp();
    std::string positions = Triple(X_WR.translation()) + " " + QuaternionWxyz(X_WR.linear());
    for (const int joint : order) positions += " " + Number(tree_.joints[joint].start);
    // The servos' targets are where the joints stand, so that nothing moves at first.
    std::string controls;
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.type == JointType::kFixed) continue;
      controls += (controls.empty() ? "" : " ") + Number(joint.start);
    }
    const pugi::xml_node key = xml::Append(xml::Append(root_, "keyframe"), "key",
                                           {{"name", "start"}, {"qpos", positions}});
    if (!controls.empty()) xml::Set(key, "ctrl", controls);
  }

  const model::Model& model_;
  RobotTree tree_;
  const std::string& stem_;
  const std::vector<world::Obstacle>& obstacles_;
  std::string base_;
  Exported exported_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

}  // namespace

Exported ToMjcf(const model::Model& model, const RobotTree& tree, const std::string& stem,
                const std::vector<world::Obstacle>& obstacles) {
  return MjcfWriter(model, tree, stem, obstacles).Write();
}

}  // namespace morphbus::emit
