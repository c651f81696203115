#include "compiler/emit/mjcf_bodies.h"

#include <fmt/format.h>

#include <utility>

#include "compiler/emit/meshes.h"
#include "compiler/emit/names.h"
#include "compiler/emit/numbers.h"
#include "compiler/keywords/xml_text.h"

namespace morphbus::emit {
namespace {

using model::JointType;

/// The most levels of nested bodies in a file: well below the 100 elements that MuJoCo reads.
constexpr int kMostLevels = 64;

/// Of geoms: what viewers show unless they are told otherwise, and what they do not.
constexpr const char* kSeenGroup = "1";
constexpr const char* kUnseenGroup = "3";

/// Writes the joint by which the body moves against its parent. The body stands where its joint
/// is at the start value, which `ref` tells MuJoCo.
void AppendJoint(pugi::xml_node body, const TreeJoint& joint) {
  if (joint.type == JointType::kFixed) return;
  const pugi::xml_node node =
      xml::Append(body, "joint",
                  {{"name", joint.name},
                   {"type", joint.type == JointType::kPrismatic ? "slide" : "hinge"},
                   {"pos", Triple(joint.origin)},
                   {"axis", Triple(joint.axis)},
                   {"ref", Number(joint.start)}});
  // A continuous joint has no range.
  if (joint.type != JointType::kContinuous) {
    xml::Set(node, "range", Number(joint.lower) + " " + Number(joint.upper));
  }
  // A motor's line of torque over speed: all of it standing, none left at full speed. The rotor,
  // seen through its gear, has inertia too; without it MuJoCo, which leaves damping out when it
  // solves constraints, would pull at light links in vain, and loops would gape.
  const double damping = joint.effort / joint.speed;
  xml::Set(node, "damping", Number(damping));
  xml::Set(node, "armature", Number(kMjcfRunUp * damping));
}

}  // namespace

std::string MjcfPartsFolder(const std::string& stem) { return stem + "_parts"; }

std::string MjcfLoopBody(const TreeLoop& loop) { return loop.name + ".loop"; }

void AppendMjcfFriction(const std::optional<double>& friction, pugi::xml_node geom) {
  if (!friction) return;
  xml::Set(geom, "friction", Number(*friction) + " 0.005 0.0001");
  xml::Set(geom, "priority", "1");
}

MjcfBodies::MjcfBodies(const model::Model& model, const RobotTree& tree, const std::string& stem,
                       pugi::xml_node base)
    : model_(model), solids_(model), tree_(tree), stem_(stem), base_(base) {
  std::vector<int> bodies_of(tree.links.size(), 1);  // Over which a link's mass is spread.
  for (const TreeLoop& loop : tree.loops) {
    if (loop.joint >= 0) ++bodies_of[loop.to];
  }
  // AppendBody returns references into this list, so that it must not move.
  bodies_.reserve(tree.links.size() + tree.loops.size());
  for (size_t i = 0; i < tree.links.size(); ++i) {
    const TreeLink& link = tree.links[i];
    const Body& body = AppendBody(link.parent, link.name, link.joint, link.X_PL);
    AppendMass(body.node, link, 1.0 / bodies_of[i]);
    AppendGeoms(body.node, link);
  }
  // After the links, so that MuJoCo numbers those of a body's children first.
  for (const TreeLoop& loop : tree.loops) {
    if (loop.joint < 0) continue;
    const Body& body =
        AppendBody(loop.from, MjcfLoopBody(loop), loop.joint, model::Pose::Identity());
    AppendMass(body.node, tree.links[loop.to], 1.0 / bodies_of[loop.to]);
  }
}

std::vector<int> MjcfBodies::JointOrder() const {
  // A walk in depth with a stack of its own: trees are deeper than the processor's may be.
  std::vector<int> order;
  std::vector<int> next(roots_.rbegin(), roots_.rend());
  while (!next.empty()) {
    const Body& body = bodies_[next.back()];
    next.pop_back();
    const bool moves = body.joint >= 0 && tree_.joints[body.joint].type != JointType::kFixed;
    if (moves) order.push_back(body.joint);
    next.insert(next.end(), body.children.rbegin(), body.children.rend());
  }
  return order;
}

std::vector<CompanionFile> MjcfBodies::Parts() const {
  std::vector<CompanionFile> files;
  for (const auto& part : parts_) files.push_back({part->path, xml::Text(part->document)});
  return files;
}

MjcfBodies::Body& MjcfBodies::AppendBody(int parent, const std::string& name, int joint,
                                         const model::Pose& X_PL) {
  Body body;
  // MuJoCo's reader stops at a depth of elements, so a body too deep in its file begins another.
  pugi::xml_node outer = base_;
  if (parent >= 0) {
    const Body& around = bodies_[parent];
    outer = around.node;
    body.level = around.level + 1;
  }
  if (body.level == kMostLevels) {
    outer = StartPart(outer);
    body.level = 0;
  }
  body.joint = joint;
  // The body stands where the joint's start value places it.
  const model::Pose X = StartInParent(tree_, X_PL, joint);
  body.node = xml::Append(
      outer, "body",
      {{"name", name}, {"pos", Triple(X.translation())}, {"quat", QuaternionWxyz(X.linear())}});
  if (joint >= 0) AppendJoint(body.node, tree_.joints[joint]);
  // MuJoCo numbers joints by where their bodies stand, which the children's order keeps.
  (parent < 0 ? roots_ : bodies_[parent].children).push_back(static_cast<int>(bodies_.size()));
  bodies_.push_back(std::move(body));
  return bodies_.back();
}

pugi::xml_node MjcfBodies::StartPart(pugi::xml_node from) {
  auto part = std::make_unique<Part>();
  part->path = fmt::format("{}/{}.xml", MjcfPartsFolder(stem_), parts_.size() + 1);
  xml::Append(from, "include", {{"file", part->path}});
  // The root element of a file that another includes.
  xml::Start(&part->document);
  pugi::xml_node root = part->document.append_child("mujocoinclude");
  parts_.push_back(std::move(part));
  return root;
}

void MjcfBodies::AppendGeoms(pugi::xml_node body, const TreeLink& link) {
  // What is only seen comes in the group that viewers show, and touches nothing.
  const std::vector<LookMesh>& looks = solids_.Looks(link.type, link.link);
  for (const LookMesh& look : looks) {
    pugi::xml_node geom = xml::Append(body, "geom",
                                      {{"type", "mesh"},
                                       {"mesh", look.name},
                                       {"contype", "0"},
                                       {"conaffinity", "0"},
                                       {"group", kSeenGroup}});
    if (look.color) xml::Set(geom, "rgba", Rgba(*look.color));
  }
  // What touches is hidden where there is something to see.
  const std::vector<std::string> meshes = MeshNames(model_, link);
  for (size_t part = 0; part < meshes.size(); ++part) {
    const std::string name =
        meshes.size() == 1 ? link.name : FreeName(tree_, PartName(link.name, part + 1));
    pugi::xml_node geom =
        xml::Append(body, "geom", {{"name", name}, {"type", "mesh"}, {"mesh", meshes[part]}});
    if (!looks.empty()) xml::Set(geom, "group", kUnseenGroup);
    AppendMjcfFriction(LinkOf(model_, link).friction, geom);
  }
}

void MjcfBodies::AppendMass(pugi::xml_node body, const TreeLink& link, double part) {
  const model::LinkMass& mass = solids_.Mass(link.type, link.link);
  const Eigen::Matrix3d I = part * mass.I_Lcm_L;
  xml::Append(body, "inertial",
              {{"pos", Triple(mass.p_LoLcm_L)},
               {"mass", Number(part * mass.mass_kg)},
               {"fullinertia", Triple(I.diagonal()) + " " + Triple({I(0, 1), I(0, 2), I(1, 2)})}});
}

}  // namespace morphbus::emit
