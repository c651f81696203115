#include "compiler/emit/sdf_joint.h"

#include "compiler/emit/numbers.h"
#include "compiler/emit/xml_text.h"

namespace morphbus::emit {

using model::JointType;

void AppendSdfJoint(pugi::xml_node parent, const std::string& name, const TreeJoint* joint,
                    const std::string& from, const std::string& to, double at,
                    const model::Pose& X_CL) {
  const JointType type = joint == nullptr ? JointType::kFixed : joint->type;
  pugi::xml_node node = parent.append_child("joint");
  Set(node, "name", name);
  Set(node, "type", JointTypeName(type));
  AppendText(node, "parent", from);
  AppendText(node, "child", to);
  if (type == JointType::kFixed) return;
  // The joint's frame is the child's, moved to the axis, which keeps its place in the child
  // whatever the joint's value.
  AppendText(node, "pose", Triple(X_CL * joint->origin) + " 0 0 0");
  pugi::xml_node axis = node.append_child("axis");
  AppendText(axis, "xyz", Triple(X_CL.linear() * joint->axis));
  pugi::xml_node limit = axis.append_child("limit");
  if (type != JointType::kContinuous) {
    AppendText(limit, "lower", Number(joint->lower - at));
    AppendText(limit, "upper", Number(joint->upper - at));
  }
  AppendText(limit, "effort", Number(joint->effort));
  AppendText(limit, "velocity", Number(joint->speed));
}

}  // namespace morphbus::emit
