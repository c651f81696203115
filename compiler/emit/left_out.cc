#include "compiler/emit/left_out.h"

#include <fmt/format.h>

#include "compiler/base/text.h"

namespace morphbus::emit {

void WarnOfLeftOut(std::string_view format, const model::Model& model, const std::set<int>& types,
                   std::vector<std::string>* warnings) {
  std::vector<std::string> backlash;
  std::vector<std::string> delay;
  std::vector<std::string> spread;
  for (const int t : types) {
    const model::ModuleType& type = model.module_types[t];
    for (const model::Joint& joint : type.joints) {
      if (joint.backlash > 0.0) backlash.push_back(type.name + "." + joint.name);
      if (joint.delay_s > 0.0) delay.push_back(type.name + "." + joint.name);
    }
    for (const model::Link& link : type.links) {
      if (link.mass_spread > 0.0) spread.push_back(type.name + "." + link.name);
    }
  }
  // Whoever reads the file should not take the robot in it for the one that was simulated.
  const auto warn = [&](const std::vector<std::string>& names, std::string_view what) {
    constexpr size_t kMostNamed = 10;
    if (names.empty()) return;
    warnings->push_back(
        fmt::format("{} holds no {}: left out of {}", format, what, NameFirst(names, kMostNamed)));
  };
  warn(backlash, "backlash");
  warn(delay, "delay of commands");
  warn(spread, "spread of masses");
}

void WarnOfLeftOut(std::string_view format, const model::Model& model, const RobotTree& tree,
                   std::vector<std::string>* warnings) {
  std::set<int> types;
  for (const TreeLink& link : tree.links) types.insert(link.type);
  WarnOfLeftOut(format, model, types, warnings);
}

}  // namespace morphbus::emit
