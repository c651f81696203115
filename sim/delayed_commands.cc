#include "sim/delayed_commands.h"

#include <cmath>

namespace morphbus::sim {

DelayedCommands::DelayedCommands(const std::vector<JointSpec>& joints, double step_s) {
  for (const JointSpec& joint : joints) {
    const int64_t steps = std::llround(joint.delay_s / step_s);
    if (steps > 0) lines_[{joint.module, joint.joint}].steps = steps;
  }
}

bool DelayedCommands::Put(int module, int joint, const morphbus::joint_command_t& command,
                          int64_t step) {
  const auto line = lines_.find({module, joint});
  if (line == lines_.end()) return false;
  line->second.coming.emplace_back(step + line->second.steps, command);
  return true;
}

void DelayedCommands::Deliver(int64_t step, const Taker& take) {
  for (auto& [joint, line] : lines_) {
    while (!line.coming.empty() && line.coming.front().first <= step) {
      line.last = std::move(line.coming.front().second);
      line.coming.pop_front();
      take(joint.first, joint.second, *line.last);
    }
  }
}

void DelayedCommands::Repeat(const Taker& take) const {
  for (const auto& [joint, line] : lines_) {
    if (line.last) take(joint.first, joint.second, *line.last);
  }
}

void DelayedCommands::Forget(int module) {
  std::erase_if(lines_, [module](const auto& line) { return line.first.first == module; });
}

}  // namespace morphbus::sim
