#include "tools/spy/spy_commander.h"

#include <fmt/format.h>

#include <utility>

#include "bridge/bus/lcm_bus.h"
#include "bridge/control/control_service.h"
#include "compiler/base/text.h"
#include "tools/launch/controlled_run.h"
#include "tools/spy/screen.h"

namespace morphbus::tools {

SpyCommander::SpyCommander(RunChoice choice, std::string url)
    : choice_(std::move(choice)), url_(std::move(url)) {}

SpyCommander::~SpyCommander() {
  // The command that is under way is given up, whatever becomes of it.
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

bool SpyCommander::Give(const std::string& command) {
  // One command at a time, so that each answer belongs to the last key.
  if (thread_.joinable()) return false;
  done_ = false;
  thread_ = std::thread([this, command] {
    outcome_ = Run(command);
    done_ = true;
  });
  return true;
}

std::optional<CommandOutcome> SpyCommander::Outcome() {
  // The thread has written its outcome before it said so.
  if (!thread_.joinable() || !done_) return std::nullopt;
  thread_.join();
  return outcome_;
}

CommandOutcome SpyCommander::Run(const std::string& command) const {
  // A bus that was named without a run may be another host's, where nobody here has the key.
  if (choice_.run.empty() && !choice_.lcm_url.empty()) {
    return {"commands need --run: only a run of this machine can be commanded", true};
  }
  // The run's key is read anew each time: the run may be another one by now.
  const Result<ControlledRun> run = FindControlled(choice_.run);
  if (!run) return {Visible(run.error().message), true};
  const Result<std::unique_ptr<bridge::Bus>> bus = bridge::OpenLcmBus(url_);
  if (!bus) return {Visible(bus.error().message), true};
  const bridge::Sender sender = {run->entry.name, "TOOL", run->plan.description.model_hash(), 0};
  const Result<bridge::ControlAnswer> answer =
      bridge::GiveCommand(bus->get(), bridge::MonotonicTime(), sender, run->key, command,
                          kControlPatienceUs, [this] { return stop_.load(); });
  if (!answer) return {Visible(answer.error().message), true};
  using State = bridge::ControlAnswer::State;
  if (answer->state == State::kRefused) {
    return {fmt::format("{}: {}", command, Visible(answer->reason)), true};
  }
  // In which tick it took effect.
  const double seconds = Seconds(answer->tick * run->plan.description.tick_us());
  return {fmt::format("{}: tick {} ({:.2f} s){}", command, answer->tick, seconds,
                      answer->state == State::kLater ? ", once the run goes on" : ""),
          false};
}

}  // namespace morphbus::tools
