#include "compiler/emit/sdf_joint.h"

#include "compiler/emit/numbers.h"
#include "compiler/keywords/xml_text.h"

namespace morphbus::emit {

using model::JointType;

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

}  // namespace morphbus::emit
