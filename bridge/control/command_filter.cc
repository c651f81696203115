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
  const int64_t sequence = message.header.sequence;
  const bool is_new = message.counter > last_;
  if (!is_new) ++ledger_.old_commands;
  // Who gives a command once more numbers it anew; under the same number the network doubled it, or
  // somebody said it again who only listens.
  const auto known = std::ranges::find(heard_, message.counter, &Heard::counter);
  if (known != heard_.end()) {
    if (sequence <= known->sequence) return Kind::kRepeat;
    known->sequence = sequence;
    return known->taken ? Kind::kAgain : Kind::kOvertaken;
  }
  if (message.counter <= forgotten_) return Kind::kRepeat;
  heard_.push_back({message.counter, sequence, is_new});
  if (heard_.size() > kRemembered) {
    forgotten_ = std::max(forgotten_, heard_.front().counter);
    heard_.pop_front();
  }
  // From here on this one, and everything before it, is known.
  if (is_new) last_ = message.counter;
  return is_new ? Kind::kNew : Kind::kOvertaken;
}

}  // namespace morphbus::bridge
