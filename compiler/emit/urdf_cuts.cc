#include "compiler/emit/urdf_cuts.h"

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "compiler/emit/numbers.h"
#include "compiler/keywords/xml_text.h"

namespace morphbus::emit {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kClosed = 1e-6;  // m, and as good as rad.

/// A number without rounding noise, as everywhere in exported files.
Json Plain(double value) { return Json::parse(Number(value)); }

/// A vector as [x, y, z].
Json VectorOf(const Eigen::Vector3d& v) {
  return Json::array({Plain(v.x()), Plain(v.y()), Plain(v.z())});
}

/// A pose as position and quaternion w x y z, of the two always the same one.
Json PoseOf(const model::Pose& X) {
  const Eigen::Quaterniond q = Canonical(X.linear());
  return Json{{"p", VectorOf(X.translation())},
              {"q", Json::array({Plain(q.w()), Plain(q.x()), Plain(q.y()), Plain(q.z())})}};
}

// The words are part of the format of the list of cuts (docs/export.md).
const char* LossName(TreeLoop::Loss loss) {
  switch (loss) {
    case TreeLoop::Loss::kNothing:
      return "nothing";
    case TreeLoop::Loss::kLockedJoint:
      return "a locked joint";
    case TreeLoop::Loss::kLoop:
      break;
  }
  return "a loop";
}

// A joint that was cut comes with all that the tree would have said of it.
void AddJoint(const TreeJoint& joint, Json* cut) {
  (*cut)["type"] = model::JointTypeName(joint.type);
  if (joint.type == model::JointType::kFixed) return;
  (*cut)["origin"] = VectorOf(joint.origin);
  (*cut)["axis"] = VectorOf(joint.axis);
  if (joint.type != model::JointType::kContinuous) {
    (*cut)["lower"] = Plain(joint.lower);
    (*cut)["upper"] = Plain(joint.upper);
  }
  (*cut)["effort"] = Plain(joint.effort);
  (*cut)["speed"] = Plain(joint.speed);
}

/// Whether the ends of each loop meet at joint values 0, where links of a URDF file stand in Gazebo
/// when it makes the joint.
std::vector<bool> LoopsClosedAtZero(const RobotTree& tree) {
  // Poses of all links with every joint at 0.
  std::vector<model::Pose> X_RL;
  for (const TreeLink& link : tree.links) {
    X_RL.push_back(link.parent < 0 ? link.X_PL : X_RL[link.parent] * link.X_PL);
  }
  std::vector<bool> closed;
  for (const TreeLoop& loop : tree.loops) {
    // T is where the loop holds the link; it closes where the tree has put the link there.
    const model::Pose X_RT = X_RL[loop.from] * loop.X_FT;
    closed.push_back((X_RT.matrix() - X_RL[loop.to].matrix()).norm() < kClosed);
  }
  return closed;
}

}  // namespace

void AppendGazeboJoints(const RobotTree& tree, const std::vector<CarryingLink>& carrying,
                        pugi::xml_node robot) {
  const std::vector<bool> closed = LoopsClosedAtZero(tree);
  for (size_t i = 0; i < tree.loops.size(); ++i) {
    // A loop whose ends other connections hold together needs no joint.
    const TreeLoop& loop = tree.loops[i];
    if (loop.loss == TreeLoop::Loss::kNothing) continue;
    // Gazebo would pull such ends together.
    if (!closed[i]) {
      xml::Comment(robot,
                   "No joint for Gazebo closes " + loop.name +
                       ": its ends stand apart at joint values 0, where Gazebo would join them.");
      continue;
    }
    const TreeJoint* joint = loop.joint < 0 ? nullptr : &tree.joints[loop.joint];
    const CarryingLink& to = carrying[loop.to];
    AppendSdfJoint(robot.append_child("gazebo"), loop.name, joint, carrying[loop.from].name,
                   to.name, 0.0, to.X_CL);
  }
}

std::string CutsJson(const RobotTree& tree) {
  // What another program needs to close the loops again: which links, where, and by what kind of
  // joint.
  Json cuts = Json::array();
  for (const TreeLoop& loop : tree.loops) {
    Json cut{{"name", loop.name},
             {"kind", loop.joint < 0 ? "connection" : "joint"},
             {"loses", LossName(loop.loss)},
             {"parent", tree.links[loop.from].name},
             {"child", tree.links[loop.to].name},
             {"pose", PoseOf(loop.X_FT)}};
    if (loop.joint >= 0) AddJoint(tree.joints[loop.joint], &cut);
    cuts.push_back(std::move(cut));
  }
  return Json{{"robot", tree.name}, {"cuts", std::move(cuts)}}.dump(2) + "\n";
}

}  // namespace morphbus::emit
