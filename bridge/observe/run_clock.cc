#include "bridge/observe/run_clock.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bridge/control/control_command.h"

namespace morphbus::bridge {

std::vector<ControlCommand> CommandsIn(const morphbus::sim_clock_t& clock) {
  std::vector<ControlCommand> commands;
  for (const std::string& text : clock.controls) {
    Result<ControlCommand> command = ParseControl(text);
    if (command) commands.push_back(std::move(*command));
  }
  return commands;
}

void RunClock::Take(const morphbus::sim_clock_t& clock) {
  // Where the run is.
  repeats_ = 0;
  tick_ = clock.header.tick;
  time_us_ = clock.header.sim_time_us;
  tick_us_ = clock.tick_us;
  has_world_ = clock.num_world_parts > 0;
  ended_ = clock.phase == morphbus::sim_clock_t::PHASE_END;
  end_reason_ = clock.end_reason;
  std::erase_if(pushes_, [&](const Push& push) { return push.until_us <= time_us_; });
  // Of the commands that took effect, these last.
  for (const ControlCommand& command : CommandsIn(clock)) {
    // A step holds the run when it is done, whether it was paused before or not.
    if (command.kind == ControlKind::kPause) paused_ = true;
    if (command.kind == ControlKind::kStep) paused_ = true;
    if (command.kind == ControlKind::kResume) paused_ = false;
    if (command.kind == ControlKind::kSpeed) speed_ = command.speed;
    if (command.kind == ControlKind::kPush) TakePush(command);
    if (command.kind == ControlKind::kLose) lost_.insert(command.part.module);
  }
}

void RunClock::TakePush(const ControlCommand& command) {
  const auto& d = command.direction_W;
  const double length = std::hypot(d[0], d[1], d[2]);
  if (length == 0.0 || pushes_.size() >= kMostPushes) return;
  const double scale = command.newtons / length;
  // Without a time it lasts for the tick in which it begins.
  const double seconds = std::max(command.seconds, 1e-6 * tick_us_);
  pushes_.push_back({command.part.module,
                     command.part.part,
                     {d[0] * scale, d[1] * scale, d[2] * scale},
                     time_us_ + static_cast<int64_t>(std::llround(seconds * 1e6))});
}

}  // namespace morphbus::bridge
