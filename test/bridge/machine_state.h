#pragma once
// The states of the lockstep's machines as texts, for tests that explore every order of events and
// must know which states they have been in.

#include <charconv>
#include <cstdint>
#include <ranges>
#include <string>
#include <type_traits>
#include <utility>

#include "bridge/lockstep/log/log_lockstep.h"
#include "bridge/lockstep/module/module_lockstep.h"
#include "bridge/lockstep/sim/sim_lockstep.h"

namespace morphbus::bridge {

/// Adds a number, flag or enum to the text. Texts are kept by the hundred thousand while a test
/// explores, and a state is mostly flags, so a flag takes one character; a number ends with a
/// comma, so that it cannot run on into the next one.
template <class T>
void AddPrint(const T& part, std::string* print) {
  if constexpr (std::is_same_v<T, bool>) {
    *print += part ? '1' : '0';
  } else {
    char digits[24];
    char* end = std::to_chars(digits, digits + 20, static_cast<int64_t>(part)).ptr;
    *end++ = ',';
    print->append(digits, end);
  }
}
/// Adds both parts of an entry of a map.
template <class A, class B>
void AddPrint(const std::pair<A, B>& part, std::string* print);
/// Adds every element, with marks where they begin and end.
template <std::ranges::range Range>
void AddPrint(const Range& parts, std::string* print) {
  *print += '[';
  for (const auto& part : parts) AddPrint(part, print);
  *print += ']';
}
template <class A, class B>
void AddPrint(const std::pair<A, B>& part, std::string* print) {
  AddPrint(part.first, print);
  AddPrint(part.second, print);
}

/// Adds whatever decides what a machine does next, times excepted: states with equal texts need
/// exploring only once. The parts are numbers, flags, enums, and ranges and pairs of these. Texts
/// are made by the million, hence one that grows.
template <class... Parts>
void AddPrints(std::string* print, const Parts&... parts) {
  (AddPrint(parts, print), ...);
}

/// Reads what the machines keep to themselves. Print adds everything but times: equal states are
/// equal texts.
struct MachineState {
  static void Print(const SimLockstep& m, std::string* print) {
    AddPrints(print, m.phase_, m.tick_, m.acknowledged_, m.steps_);
    const Attendance& a = m.attendance_;
    AddPrints(print, a.greeted_, a.answered_, a.acknowledged_, a.leaving_, a.gone_);
    AddPrints(print, m.barrier_, m.at_barrier_, m.leave_.armed(), m.stop_, m.paused_, m.holding_,
              m.ask_.armed(), m.silent_);
  }
  static void Print(const ModuleLockstep& m, std::string* print) {
    AddPrints(print, m.phase_, m.tick_, m.end_tick_, m.have_reading_, m.knows_all_, m.ahead_tick_,
              m.ask_.armed(), m.hello_.sim_heard(), m.parts_, m.mates_);
    // Ticks too old to be of use make no difference.
    for (const ModuleLockstep::Mate& mate : m.heard_) {
      AddPrint(mate.id, print);
      for (const int64_t tick : mate.ticks) AddPrint(tick < m.tick_ - 1 ? -1 : tick, print);
    }
  }
  static void Print(const LogLockstep& m, std::string* print) {
    AddPrints(print, m.phase_, m.highest_tick_, m.end_tick_, m.complete_tick_, m.acked_tick_,
              m.num_modules_, m.ask_.armed(), m.hello_.sim_heard(), m.verdict_heard_, m.names_);
    const auto add = [print](const LogLockstep::ReceivedSet& received) {
      AddPrints(print, received.next, received.beyond);
    };
    for (const auto* received : {&m.clock_, &m.sensors_, &m.world_}) add(*received);
    for (const LogLockstep::Module& module : m.modules_) {
      for (const auto* received : {&module.transform, &module.actuator, &module.status}) {
        add(*received);
      }
      AddPrint(module.status_counts, print);
    }
    for (const auto& [name, tick] : m.lost_) AddPrints(print, name, tick);
  }
  /// The last tick of which the logger has everything, as far as the simulator knows; -1 for none.
  static int64_t AcknowledgedTick(const SimLockstep& m) { return m.acknowledged_; }
};

}  // namespace morphbus::bridge
