#include "compiler/emit/mjcf_bodies.h"

#include <fmt/format.h>

#include "compiler/emit/numbers.h"
#include "compiler/emit/xml_text.h"

namespace morphbus::emit {
namespace {

using model::JointType;

/// Of nested bodies in a file: well below the 100 elements that MuJoCo reads.
constexpr int kMostLevels = 64;

}  // namespace

std::string MjcfMeshName(const model::Model& model, const TreeLink& link) {
  const model::ModuleType& type = model.module_types[static_cast<size_t>(link.type)];
  const model::Link& source = type.links[static_cast<size_t>(link.link)];
  return source.hull.empty() ? "" : type.name + "." + source.name;
}

std::string MjcfPartsFolder(const std::string& stem) { return stem + "_parts"; }

std::string MjcfLoopBody(const TreeLoop& loop) { return loop.name + ".loop"; }

MjcfBodies::MjcfBodies(const model::Model& model, const RobotTree& tree, const std::string& stem,
                       pugi::xml_node base)
    : model_(model), solids_(model), tree_(tree), stem_(stem), base_(base) {
  std::vector<int> bodies_of(tree.links.size(), 1);  // Over which a link's mass is spread.
  for (const TreeLoop& loop : tree.loops) {
    if (loop.joint >= 0) ++bodies_of[static_cast<size_t>(loop.to)];
  }
  bodies_.reserve(tree.links.size() + tree.loops.size());
  for (size_t i = 0; i < tree.links.size(); ++i) {
    const TreeLink& link = tree.links[i];
    const Body& body = AppendBody(link.parent, link.name, link.joint, link.X_PL);
    AppendMass(body.node, link, 1.0 / bodies_of[i]);
    const std::string mesh = MjcfMeshName(model_, link);
    if (mesh.empty()) continue;
    pugi::xml_node geom = pugi::xml_node(body.node).append_child("geom");
    Set(geom, "name", link.name);
    Set(geom, "type", "mesh");
    Set(geom, "mesh", mesh);
  }
  // After the links, so that MuJoCo numbers those of a body's children first.
  for (const TreeLoop& loop : tree.loops) {
    if (loop.joint < 0) continue;
    const auto to = static_cast<size_t>(loop.to);
    const Body& body =
        AppendBody(loop.from, MjcfLoopBody(loop), loop.joint, model::Pose::Identity());
    AppendMass(body.node, tree.links[to], 1.0 / bodies_of[to]);
  }
}

MjcfBodies::Body& MjcfBodies::AppendBody(int parent, const std::string& name, int joint,
                                         const model::Pose& X_PL) {
  Body body;
  pugi::xml_node outer = base_;
  if (parent >= 0) {
    const Body& around = bodies_[static_cast<size_t>(parent)];
    outer = around.node;
    body.level = around.level + 1;
  }
  if (body.level == kMostLevels) {
    outer = StartPart(outer);
    body.level = 0;
  }
  body.node = outer.append_child("body");
  body.joint = joint;
  const bool moves = joint >= 0;
  model::Pose X = X_PL;
  if (moves) {
    const TreeJoint& of = tree_.joints[static_cast<size_t>(joint)];
    X = X * MotionOf(of, of.start);
  }
  Set(body.node, "name", name);
  Set(body.node, "pos", Triple(X.translation()));
  Set(body.node, "quat", QuaternionWxyz(X.linear()));
  if (moves) AppendJoint(body.node, tree_.joints[static_cast<size_t>(joint)]);
  (parent < 0 ? roots_ : bodies_[static_cast<size_t>(parent)].children)
      .push_back(static_cast<int>(bodies_.size()));
  bodies_.push_back(std::move(body));
  return bodies_.back();
}

pugi::xml_node MjcfBodies::StartPart(pugi::xml_node from) {
  auto part = std::make_unique<Part>();
  part->path = fmt::format("{}/{}.xml", MjcfPartsFolder(stem_), parts_.size() + 1);
  Set(from.append_child("include"), "file", part->path);
  StartXml(&part->document);
  pugi::xml_node root = part->document.append_child("mujocoinclude");
  parts_.push_back(std::move(part));
  return root;
}

/// The body stands where its joint is at the start value, which `ref` tells MuJoCo.
void MjcfBodies::AppendJoint(pugi::xml_node body, const TreeJoint& joint) {
  if (joint.type == JointType::kFixed) return;
  pugi::xml_node node = body.append_child("joint");
  Set(node, "name", joint.name);
  Set(node, "type", joint.type == JointType::kPrismatic ? "slide" : "hinge");
  Set(node, "pos", Triple(joint.origin));
  Set(node, "axis", Triple(joint.axis));
  Set(node, "ref", Number(joint.start));
  if (joint.type != JointType::kContinuous) {
    Set(node, "range", Number(joint.lower) + " " + Number(joint.upper));
  }
  // A motor's line of torque over speed: all of it standing, none left at full speed. The rotor,
  // seen through its gear, has inertia too; without it MuJoCo, which leaves damping out when it
  // solves constraints, would pull at light links in vain, and loops would gape.
  const double damping = joint.effort / joint.speed;
  Set(node, "damping", Number(damping));
  Set(node, "armature", Number(kMjcfRunUp * damping));
}

void MjcfBodies::AppendMass(pugi::xml_node body, const TreeLink& link, double part) {
  const model::LinkMass& mass = solids_.Mass(link.type, link.link);
  const Eigen::Matrix3d I = part * mass.I_Lcm_L;
  pugi::xml_node inertial = body.append_child("inertial");
  Set(inertial, "pos", Triple(mass.p_LoLcm_L));
  Set(inertial, "mass", Number(part * mass.mass_kg));
  Set(inertial, "fullinertia", Triple(I.diagonal()) + " " + Triple({I(0, 1), I(0, 2), I(1, 2)}));
}

std::vector<int> MjcfBodies::JointOrder() const {
  std::vector<int> order;
  std::vector<int> next(roots_.rbegin(), roots_.rend());
  while (!next.empty()) {
    const Body& body = bodies_[static_cast<size_t>(next.back())];
    next.pop_back();
    const bool moves =
        body.joint >= 0 && tree_.joints[static_cast<size_t>(body.joint)].type != JointType::kFixed;
    if (moves) order.push_back(body.joint);
    next.insert(next.end(), body.children.rbegin(), body.children.rend());
  }
  return order;
}

std::vector<CompanionFile> MjcfBodies::Parts() const {
  std::vector<CompanionFile> files;
  for (const auto& part : parts_) files.push_back({part->path, XmlText(part->document)});
  return files;
}

}  // namespace morphbus::emit
