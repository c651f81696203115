#pragma once
// Commands on their way to servos that take them late.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <morphbus/joint_command_t.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "sim/rigid_body_model.h"

namespace morphbus::sim {

/// Keeps the commands of those joints that have a delay, by the module's own numbers, so that they
/// outlive a change of the structure.
class DelayedCommands {
 public:
  /// Of no joint.
  DelayedCommands() = default;
  /// The delays of `joints` in steps of `step_s` seconds, each the nearest number of whole ones.
  DelayedCommands(const std::vector<JointSpec>& joints, double step_s);

  /// Takes a command that was given before step number `step`. False, and nothing done, if the
  /// joint has no delay.
  bool Put(int module, int joint, const morphbus::joint_command_t& command, int64_t step);

  /// Gets a command that a servo is to take.
  using Taker = std::function<void(int module, int joint, const morphbus::joint_command_t&)>;
  /// Hands over what arrives before step number `step`, the later one last.
  void Deliver(int64_t step, const Taker& take);
  /// Hands over once more what arrived last at each joint, for servos that have forgotten it.
  void Repeat(const Taker& take) const;

  /// The servos of a module are dead: they take nothing any more.
  void Forget(int module);

 private:
  struct Line {
    int64_t steps = 0;
    /// With the step before which they arrive.
    std::deque<std::pair<int64_t, morphbus::joint_command_t>> coming;
    std::optional<morphbus::joint_command_t> last;
  };
  /// By module and joint.
  std::map<std::pair<int, int>, Line> lines_;
};

}  // namespace morphbus::sim
