#pragma once
// Which of the messages on CONTROL are commands that have not been taken yet.

#include <cstdint>
#include <deque>
#include <morphbus/control_t.hpp>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// Tells new commands from old ones by their counters, which grow from command to command whoever
/// gives them, so that what goes over the bus again is done once. What is old is counted in the
/// sim's ledger.
class CommandFilter {
 public:
  enum class Kind : uint8_t {
    /// A command that is to be obeyed.
    kNew,
    /// A command that was taken before, given once more: its sender has not heard the answer.
    kAgain,
    /// A message that came before, or a command too old to be remembered: nobody waits for answers.
    kRepeat,
    /// One that a later command came before; whoever gave it may give it anew.
    kOvertaken,
    /// What the sim itself said.
    kAnswer,
  };

  /// `ledger` outlives the filter.
  explicit CommandFilter(Ledger* ledger) : ledger_(*ledger) {}

  /// Takes a message, and says what it is.
  Kind Take(const morphbus::control_t& message);

 private:
  /// A command that is remembered.
  struct Heard {
    int64_t counter = 0;
    int64_t sequence = 0;  ///< The highest number under which its sender gave it.
    bool taken = false;    ///< It had not been overtaken.
  };

  Ledger& ledger_;
  int64_t last_ = 0;         ///< The highest counter that was taken.
  std::deque<Heard> heard_;  ///< The latest commands, oldest first.
  int64_t forgotten_ = -1;   ///< The highest counter among those before them.
};

}  // namespace morphbus::bridge
