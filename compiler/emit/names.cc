#include "compiler/emit/names.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace morphbus::emit {
namespace {

using Reserved = std::function<bool(const std::string&)>;

/// A free name in place of a reserved one, which it says in `warnings`. '_' after the name is
/// enough except for "__a__", where all names in pairs of '_' are reserved.
std::string Unreserved(const std::string& format, const std::string& kind, const std::string& name,
                       const Reserved& reserved, const RobotTree& tree,
                       std::vector<std::string>* warnings) {
  // The new name must be free in the robot and not reserved itself.
  std::string other = FreeName(tree, name + "_");
  if (reserved(other)) other = FreeName(tree, "m3l" + name);
  warnings->push_back(fmt::format("{} keeps the name {} for itself: the {} is called {} there",
                                  format, name, kind, other));
  return other;
}

}  // namespace

std::string FreeName(std::string name, const std::function<bool(const std::string&)>& taken) {
  while (taken(name)) name += '_';
  return name;
}

std::string FreeName(const RobotTree& tree, std::string name) {
  // Links, joints and connections share one space of names in the formats.
  return FreeName(std::move(name), [&](const std::string& tried) {
    const auto called = [&](const auto& part) { return part.name == tried; };
    return std::any_of(tree.links.begin(), tree.links.end(), called) ||
           std::any_of(tree.joints.begin(), tree.joints.end(), called) ||
           std::any_of(tree.loops.begin(), tree.loops.end(), called);
  });
}

void RenameReservedLinks(const std::string& format, const Reserved& reserved, RobotTree* tree,
                         std::vector<std::string>* warnings) {
  for (TreeLink& link : tree->links) {
    if (!reserved(link.name)) continue;
    link.name = Unreserved(format, "link", link.name, reserved, *tree, warnings);
  }
}

void RenameReservedJoints(const std::string& format, const Reserved& reserved, RobotTree* tree,
                          std::vector<std::string>* warnings) {
  for (size_t j = 0; j < tree->joints.size(); ++j) {
    TreeJoint& joint = tree->joints[j];
    if (!reserved(joint.name)) continue;
    joint.name = Unreserved(format, "joint", joint.name, reserved, *tree, warnings);
    // The joint's name also says what holds its link, or which loop it closes.
    if (joint.child >= 0) tree->links[joint.child].held_by = joint.name;
    for (TreeLoop& loop : tree->loops) {
      if (loop.joint == static_cast<int>(j)) loop.name = joint.name;
    }
  }
}

}  // namespace morphbus::emit
