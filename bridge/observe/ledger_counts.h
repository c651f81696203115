#pragma once
// What a process counts in its ledger, by name: for who lists the counts, or adds them up.

#include <morphbus/health_t.hpp>

namespace morphbus::bridge {

/// A count of HEALTH, and its name in health_t (lcmtypes/health_t.lcm says what it means).
struct LedgerCount {
  const char* name;
  int64_t morphbus::health_t::*value;
};

/// All of them: traffic and what the bus did to it, commands that the simulator did not take,
/// faults on purpose and deaths, sound messages that were refused all the same, what the kernel
/// refused.
inline constexpr LedgerCount kLedgerCounts[] = {
    {"received", &morphbus::health_t::received},
    {"sent", &morphbus::health_t::sent},
    {"lost", &morphbus::health_t::lost},
    {"discarded", &morphbus::health_t::discarded},
    {"duplicates", &morphbus::health_t::duplicates},
    {"resent", &morphbus::health_t::resent},
    {"asked", &morphbus::health_t::asked},
    {"queue_overflows", &morphbus::health_t::queue_overflows},
    {"bad", &morphbus::health_t::bad},
    {"unauthentic", &morphbus::health_t::unauthentic},
    {"missed_deadlines", &morphbus::health_t::missed_deadlines},
    {"old_commands", &morphbus::health_t::old_commands},
    {"malformed_commands", &morphbus::health_t::malformed_commands},
    {"doubled", &morphbus::health_t::doubled},
    {"delayed", &morphbus::health_t::delayed},
    {"corrupted", &morphbus::health_t::corrupted},
    {"restarts", &morphbus::health_t::restarts},
    {"conflicts", &morphbus::health_t::conflicts},
    {"outside_window", &morphbus::health_t::outside_window},
    {"fragments", &morphbus::health_t::fragments},
    {"refused_filters", &morphbus::health_t::refused_filters}};

}  // namespace morphbus::bridge
