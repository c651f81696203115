#include "compiler/emit/mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <pugixml.hpp>
#include <set>
#include <utility>
#include <vector>

#include "compiler/emit/mjcf_bodies.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/emit/xml_text.h"
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
  const double part =
      joint.type == JointType::kContinuous ? 0.0 : kFullForcePart * (joint.upper - joint.lower);
  return std::max(part, kLeastSettling * joint.speed);
}

class Writer {
 public:
  Writer(const model::Model& model, const RobotTree& tree, const std::string& stem)
      : model_(model), tree_(tree), stem_(stem) {
    // The name of MuJoCo's own body.
    RenameReservedLinks(
        "MJCF", [](const std::string& name) { return name == "world"; }, &tree_,
        &exported_.warnings);
    base_ = FreeName(tree_, "robot_frame");
  }

  Exported Write() {
    StartXml(&document_);
    root_ = document_.append_child("mujoco");
    Set(root_, "model", tree_.name);
    Comment(root_, "SI units, radians. The world has z up (x north, y west); " + base_ +
                       " is the robot frame: x north, y up, z east.");
    pugi::xml_node compiler = root_.append_child("compiler");
    Set(compiler, "angle", "radian");
    Set(compiler, "autolimits", "true");
    Set(root_.append_child("option"), "gravity", "0 0 -9.81");
    AppendSizes();
    AppendMeshes();
    pugi::xml_node world = root_.append_child("worldbody");
    AppendFloor(world);
    const MjcfBodies bodies(model_, tree_, stem_, AppendBase(world));
    AppendExcludes();
    AppendWelds();
    AppendActuators();
    AppendStart(bodies.JointOrder());
    exported_.text = XmlText(document_);
    exported_.companions = bodies.Parts();
    exported_.parts_folder = MjcfPartsFolder(stem_);
    return std::move(exported_);
  }

 private:
  /// Room for the contacts of a robot that lies on the floor; without it MuJoCo 2 has room for 100.
  void AppendSizes() {
    constexpr size_t kDefault = 100;
    constexpr size_t kPerLink = 4;
    constexpr size_t kMost = 2000;  // MuJoCo's memory grows by this times the joints.
    constexpr size_t kRowsOfAContact = 4;
    const size_t contacts = std::min(kPerLink * tree_.links.size(), kMost);
    if (contacts <= kDefault) return;
    pugi::xml_node size = root_.append_child("size");
    Set(size, "nconmax", fmt::format("{}", contacts));
    Set(size, "njmax",
        fmt::format("{}", kRowsOfAContact * contacts + kPerLink * tree_.links.size()));
  }

  /// MuJoCo takes the convex hull of a mesh given by its corners.
  void AppendMeshes() {
    std::map<std::string, std::string> corners;
    for (const TreeLink& link : tree_.links) {
      const std::string name = MjcfMeshName(model_, link);
      if (name.empty() || corners.count(name) != 0) continue;
      const model::ModuleType& type = model_.module_types[static_cast<size_t>(link.type)];
      std::string& text = corners[name];
      const model::ConvexHull hull = model::ComputeHull(model::SolidHull(type, link.link));
      for (const Eigen::Vector3d& p : hull.vertices) {
        text += (text.empty() ? "" : "  ") + Triple(p);
      }
    }
    if (corners.empty()) return;
    pugi::xml_node asset = root_.append_child("asset");
    for (const auto& [name, text] : corners) {
      pugi::xml_node mesh = asset.append_child("mesh");
      Set(mesh, "name", name);
      Set(mesh, "vertex", text);
    }
  }

  pugi::xml_node AppendBase(pugi::xml_node world) {
    const model::Pose X_WR = RobotFrameInZUp();
    pugi::xml_node base = world.append_child("body");
    Set(base, "name", base_);
    Set(base, "pos", Triple(X_WR.translation()));
    Set(base, "quat", QuaternionWxyz(X_WR.linear()));
    Set(base.append_child("freejoint"), "name", FreeName(tree_, base_ + ".free"));
    return base;
  }

  /// Below the robot as it stands at the start.
  void AppendFloor(pugi::xml_node world) {
    pugi::xml_node light = world.append_child("light");
    Set(light, "pos", "0 0 3");
    Set(light, "dir", "0 0 -1");
    pugi::xml_node floor = world.append_child("geom");
    Set(floor, "name", FreeName(tree_, "floor"));
    Set(floor, "type", "plane");
    Set(floor, "size", "0 0 0.1");
    Set(floor, "pos", Triple({0.0, 0.0, LowestPoint(model_, tree_) - kFloorClearance}));
  }

  /// Links that touch by construction: those one or two joints or connections apart. (MuJoCo leaves
  /// out only parent and child.)
  void AppendExcludes() {
    std::vector<std::set<int>> near(tree_.links.size());
    const auto join = [&](int a, int b) {
      near[static_cast<size_t>(a)].insert(b);
      near[static_cast<size_t>(b)].insert(a);
    };
    for (size_t i = 0; i < tree_.links.size(); ++i) {
      if (tree_.links[i].parent >= 0) join(static_cast<int>(i), tree_.links[i].parent);
    }
    for (const TreeLoop& loop : tree_.loops) join(loop.from, loop.to);
    pugi::xml_node contact = root_.append_child("contact");
    for (size_t i = 0; i < near.size(); ++i) {
      std::set<int> excluded = near[i];
      for (const int j : near[i]) {
        const std::set<int>& beyond = near[static_cast<size_t>(j)];
        excluded.insert(beyond.begin(), beyond.end());
      }
      for (const int j : excluded) {
        if (j <= static_cast<int>(i)) continue;
        pugi::xml_node exclude = contact.append_child("exclude");
        Set(exclude, "body1", tree_.links[i].name);
        Set(exclude, "body2", tree_.links[static_cast<size_t>(j)].name);
      }
    }
  }

  /// Always with relpose: without it MuJoCo would keep whatever gap there is at qpos 0.
  void AppendWelds() {
    if (tree_.loops.empty()) return;
    pugi::xml_node equality = root_.append_child("equality");
    for (const TreeLoop& loop : tree_.loops) {
      pugi::xml_node weld = equality.append_child("weld");
      Set(weld, "name", loop.name);
      Set(weld, "body1",
          loop.joint >= 0 ? MjcfLoopBody(loop) : tree_.links[static_cast<size_t>(loop.from)].name);
      Set(weld, "body2", tree_.links[static_cast<size_t>(loop.to)].name);
      Set(weld, "solref", Number(kWeldSettling) + " 1");
      Set(weld, "relpose",
          Triple(loop.X_FT.translation()) + " " + QuaternionWxyz(loop.X_FT.linear()));
    }
  }

  void AppendActuators() {
    pugi::xml_node actuator;
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.type == JointType::kFixed) continue;
      if (!actuator) actuator = root_.append_child("actuator");
      pugi::xml_node position = actuator.append_child("position");
      Set(position, "name", joint.name);
      Set(position, "joint", joint.name);
      Set(position, "kp", Number(joint.effort / FullForceError(joint)));
      if (joint.type != JointType::kContinuous) {
        Set(position, "ctrlrange", Number(joint.lower) + " " + Number(joint.upper));
      }
      Set(position, "forcerange", Number(-joint.effort) + " " + Number(joint.effort));
    }
  }

  void AppendStart(const std::vector<int>& order) {
    if (order.size() + kFreeValues > kMostKeyframeValues) {
      exported_.warnings.push_back(fmt::format(
          "MuJoCo reads keyframes of at most {} values, this robot has {}: the keyframe start is "
          "left out; the file opens at the start values, but controls are 0 until they are set",
          kMostKeyframeValues, order.size() + kFreeValues));
      return;
    }
    const model::Pose X_WR = RobotFrameInZUp();
    std::string positions = Triple(X_WR.translation()) + " " + QuaternionWxyz(X_WR.linear());
    for (const int joint : order) {
      positions += " " + Number(tree_.joints[static_cast<size_t>(joint)].start);
    }
    std::string controls;
    for (const TreeJoint& joint : tree_.joints) {
      if (joint.type == JointType::kFixed) continue;
      controls += (controls.empty() ? "" : " ") + Number(joint.start);
    }
    pugi::xml_node key = root_.append_child("keyframe").append_child("key");
    Set(key, "name", "start");
    Set(key, "qpos", positions);
    if (!controls.empty()) Set(key, "ctrl", controls);
  }

  const model::Model& model_;
  RobotTree tree_;
  const std::string& stem_;
  std::string base_;
  Exported exported_;
  pugi::xml_document document_;
  pugi::xml_node root_;
};

}  // namespace

Exported ToMjcf(const model::Model& model, const RobotTree& tree, const std::string& stem) {
  return Writer(model, tree, stem).Write();
}

}  // namespace morphbus::emit
