#include "compiler/emit/mjcf.h"

#include <fmt/format.h>

#include <map>
#include <pugixml.hpp>
#include <set>
#include <utility>
#include <vector>

#include "compiler/emit/numbers.h"
#include "compiler/emit/xml_text.h"
#include "compiler/model/convex_hull.h"

namespace morphbus::emit {
namespace {

using model::JointType;

constexpr double kFullTorqueError = 0.2;    // rad or m at which a servo gives all it has.
constexpr double kDampingPart = 0.1;        // Of the torque, at full speed.
constexpr double kTinyMass = 1e-6;          // kg
constexpr double kTinyInertia = 1e-9;       // kg m^2
constexpr double kFloorClearance = 0.5e-3;  // m

void SetPose(pugi::xml_node node, const model::Pose& X) {
  Set(node, "pos", Triple(X.translation()));
  Set(node, "quat", QuaternionWxyz(X.linear()));
}

class Writer {
 public:
  Writer(const model::Model& model, const RobotTree& tree)
      : model_(model), tree_(tree), base_(FreeLinkName(tree, "robot_frame")) {}

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
    AppendMeshes();
    AppendBodies();
    AppendExcludes();
    AppendWelds();
    AppendActuators();
    AppendStart();
    Exported exported;
    exported.text = XmlText(document_);
    return exported;
  }

 private:
  const TreeJoint& JointAt(int joint) const { return tree_.joints[static_cast<size_t>(joint)]; }
  const model::ModuleType& TypeOf(const TreeLink& link) const {
    return model_.module_types[static_cast<size_t>(link.type)];
  }
  /// Name of a link's mesh; empty without hull.
  std::string MeshName(const TreeLink& link) const {
    const model::Link& source = TypeOf(link).links[static_cast<size_t>(link.link)];
    return source.hull.empty() ? "" : TypeOf(link).name + "." + source.name;
  }

  /// MuJoCo takes the convex hull of a mesh given by its corners.
  void AppendMeshes() {
    std::map<std::string, std::string> corners;
    for (const TreeLink& link : tree_.links) {
      const std::string name = MeshName(link);
      if (name.empty() || corners.count(name) != 0) continue;
      std::string& text = corners[name];
      const model::ConvexHull hull = model::ComputeHull(model::SolidHull(TypeOf(link), link.link));
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

  void AppendBodies() {
    pugi::xml_node world = root_.append_child("worldbody");
    AppendFloor(world);
    pugi::xml_node base = world.append_child("body");
    Set(base, "name", base_);
    SetPose(base, RobotFrameInZUp());
    Set(base.append_child("freejoint"), "name", base_ + ".free");
    bodies_.reserve(tree_.links.size());
    for (const TreeLink& link : tree_.links) {
      pugi::xml_node body =
          (link.parent < 0 ? base : bodies_[static_cast<size_t>(link.parent)]).append_child("body");
      Set(body, "name", link.name);
      SetPose(body, link.X_PL);
      if (link.joint >= 0) AppendJoint(body, JointAt(link.joint));
      AppendMass(body, link);
      bodies_.push_back(body);
    }
    // After the links, so that MuJoCo numbers those first.
    for (const TreeLoop& loop : tree_.loops) {
      if (loop.joint >= 0) AppendLoopBody(bodies_[static_cast<size_t>(loop.from)], loop);
    }
  }

  /// Below the robot as it stands at the start.
  void AppendFloor(pugi::xml_node world) {
    pugi::xml_node light = world.append_child("light");
    Set(light, "pos", "0 0 3");
    Set(light, "dir", "0 0 -1");
    pugi::xml_node floor = world.append_child("geom");
    Set(floor, "name", "floor");
    Set(floor, "type", "plane");
    Set(floor, "size", "0 0 0.1");
    Set(floor, "pos", Triple({0.0, 0.0, LowestPoint(model_, tree_) - kFloorClearance}));
  }

  static void AppendJoint(pugi::xml_node body, const TreeJoint& joint) {
    if (joint.type == JointType::kFixed) return;
    const bool slides = joint.type == JointType::kPrismatic;
    pugi::xml_node node = body.append_child("joint");
    Set(node, "name", joint.name);
    Set(node, "type", slides ? "slide" : "hinge");
    Set(node, "pos", Triple(joint.origin));
    Set(node, "axis", Triple(joint.axis));
    if (joint.type != JointType::kContinuous) {
      Set(node, "range", Number(joint.lower) + " " + Number(joint.upper));
    }
    Set(node, "damping", Number(kDampingPart * joint.effort / joint.speed));
  }

  void AppendMass(pugi::xml_node body, const TreeLink& link) {
    const model::LinkMass mass = model::ComputeLinkMass(TypeOf(link), link.link);
    const Eigen::Matrix3d& I = mass.I_Lcm_L;
    pugi::xml_node inertial = body.append_child("inertial");
    Set(inertial, "pos", Triple(mass.p_LoLcm_L));
    Set(inertial, "mass", Number(mass.mass_kg));
    Set(inertial, "fullinertia", Triple(I.diagonal()) + " " + Triple({I(0, 1), I(0, 2), I(1, 2)}));
    const std::string mesh = MeshName(link);
    if (mesh.empty()) return;
    pugi::xml_node geom = body.append_child("geom");
    Set(geom, "name", link.name);
    Set(geom, "type", "mesh");
    Set(geom, "mesh", mesh);
  }

  void AppendLoopBody(pugi::xml_node parent, const TreeLoop& loop) {
    pugi::xml_node body = parent.append_child("body");
    Set(body, "name", loop.name + ".loop");
    AppendJoint(body, JointAt(loop.joint));
    pugi::xml_node inertial = body.append_child("inertial");
    Set(inertial, "pos", "0 0 0");
    Set(inertial, "mass", Number(kTinyMass));
    Set(inertial, "diaginertia", Triple(Eigen::Vector3d::Constant(kTinyInertia)));
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
          loop.joint >= 0 ? loop.name + ".loop" : tree_.links[static_cast<size_t>(loop.from)].name);
      Set(weld, "body2", tree_.links[static_cast<size_t>(loop.to)].name);
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
      Set(position, "kp", Number(joint.effort / kFullTorqueError));
      if (joint.type != JointType::kContinuous) {
        Set(position, "ctrlrange", Number(joint.lower) + " " + Number(joint.upper));
      }
      Set(position, "forcerange", Number(-joint.effort) + " " + Number(joint.effort));
    }
  }

  /// qpos lists bodies depth first, as they stand in the file.
  void AppendStart() {
    struct Collector : pugi::xml_tree_walker {
      std::map<std::string, double> start;
      std::string qpos;
      bool for_each(pugi::xml_node& node) override {
        const std::string element = node.name();
        if (element == "freejoint") {
          const pugi::xml_node body = node.parent();
          qpos += std::string(qpos.empty() ? "" : " ") + body.attribute("pos").value() + " " +
                  body.attribute("quat").value();
        } else if (element == "joint") {
          qpos += " " + Number(start[node.attribute("name").value()]);
        }
        return true;
      }
    };
    Collector collector;
    std::string controls;
    for (const TreeJoint& joint : tree_.joints) {
      collector.start[joint.name] = joint.start;
      if (joint.type == JointType::kFixed) continue;
      controls += (controls.empty() ? "" : " ") + Number(joint.start);
    }
    root_.child("worldbody").traverse(collector);
    pugi::xml_node key = root_.append_child("keyframe").append_child("key");
    Set(key, "name", "start");
    Set(key, "qpos", collector.qpos);
    if (!controls.empty()) Set(key, "ctrl", controls);
  }

  const model::Model& model_;
  const RobotTree& tree_;
  std::string base_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  std::vector<pugi::xml_node> bodies_;
};

}  // namespace

Exported ToMjcf(const model::Model& model, const RobotTree& tree) {
  return Writer(model, tree).Write();
}

}  // namespace morphbus::emit
