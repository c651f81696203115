#pragma once
// Names that other programs need beside those of M3L, or keep for themselves. M3L allows
// every name; a name that is changed is reported.

#include <functional>
#include <string>
#include <vector>

#include "compiler/emit/robot_tree.h"

namespace morphbus::emit {

/// `name`, with as many '_' after it as it takes for it not to be `taken`.
std::string FreeName(std::string name, const std::function<bool(const std::string&)>& taken);
/// `name`, or the first longer one, that none of the tree's links, joints and connections has,
/// likewise.
std::string FreeName(const RobotTree& tree, std::string name);

/// Formats keep some names for themselves, such as those of worlds and of frames.
/// Gives every link whose name is `reserved` in `format` ("SDF") a free one that is not, and says
/// so in `warnings`.
void RenameReservedLinks(const std::string& format,
                         const std::function<bool(const std::string&)>& reserved, RobotTree* tree,
                         std::vector<std::string>* warnings);
/// The same for joints: each whose name is reserved in the format gets a free one.
void RenameReservedJoints(const std::string& format,
                          const std::function<bool(const std::string&)>& reserved, RobotTree* tree,
                          std::vector<std::string>* warnings);

}  // namespace morphbus::emit
