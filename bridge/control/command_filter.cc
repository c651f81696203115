#include "bridge/control/command_filter.h"

#include <algorithm>

#include "bridge/control/control_command.h"

namespace morphbus::bridge {
namespace {

/// Commands that are remembered, to tell one that comes again from one that was overtaken.
constexpr size_t kRemembered = 1024;

}  // namespace

CommandFilter::Kind CommandFilter::Take(const morphbus::control_t& message) {
  if (IsAnswer(message.command)) return Kind::kAnswer;
  if (message.counter <= last_) {
    ++ledger_.old_commands;
    const bool again = std::ranges::find(taken_, message.counter) != taken_.end();
    return again ? Kind::kAgain : Kind::kOvertaken;
  }
  // From here on this one, and everything before it, is known.
  last_ = message.counter;
  taken_.push_back(last_);
  if (taken_.size() > kRemembered) taken_.pop_front();
  return Kind::kNew;
}

}  // namespace morphbus::bridge
