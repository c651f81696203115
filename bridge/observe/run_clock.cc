#include "bridge/observe/run_clock.h"

#include "bridge/observe/clock_commands.h"

namespace morphbus::bridge {

void RunClock::Take(const morphbus::sim_clock_t& clock) {
  // Where the run is.
  repeats_ = 0;
  tick_ = clock.header.tick;
  time_us_ = clock.header.sim_time_us;
  tick_us_ = clock.tick_us;
  has_world_ = clock.num_world_parts > 0;
  ended_ = clock.phase == morphbus::sim_clock_t::PHASE_END;
  end_reason_ = clock.end_reason;
  // Of the commands that took effect, these last.
  for (const ControlCommand& command : CommandsIn(clock)) {
    // A step holds the run when it is done, whether it was paused before or not.
    if (command.kind == ControlKind::kPause) paused_ = true;
    if (command.kind == ControlKind::kStep) paused_ = true;
    if (command.kind == ControlKind::kResume) paused_ = false;
    if (command.kind == ControlKind::kSpeed) speed_ = command.speed;
    if (command.kind == ControlKind::kLose) lost_.insert(command.part.module);
  }
}

}  // namespace morphbus::bridge
