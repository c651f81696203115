#pragma once
// HEALTH: a process's ledger and resources, once a second of wall time. Launcher and tools show it;
// nothing in a run depends on it.

#include <morphbus/health_t.hpp>
#include <string>

#include "bridge/bus/bus.h"

namespace morphbus::bridge {

/// What a process sent, received, missed and refused since it began: the counts of HEALTH, as
/// lcmtypes/health_t.lcm explains them, and its two fields about what was refused; MakeHealth fills
/// in the rest. Every authentic message that arrives counts as received or as bad; those that were
/// sound and yet refused count as received, and once more as conflicts or outside_window. Fragments
/// are dropped unread, and count as such only.
struct Ledger : morphbus::health_t {
  Ledger() : morphbus::health_t{} {}
};

/// Takes over what a bus has lost, which it counts from its beginning.
void CountLosses(const Bus& bus, Ledger* ledger);

/// The first message that had not the run's key, and the first that was refused for another reason
/// (Ledger::first_refused), for people; empty if there was none.
std::string FirstRefused(const Ledger& ledger);

/// The message for this moment: ledger, largest resident set (kilobytes), processor time used and
/// wall clock (both microseconds); nobody's lateness, no totals. The header is left to the outbox.
/// @param process  name of the process that it speaks of, which is the calling one.
morphbus::health_t MakeHealth(const std::string& process, const Ledger& ledger);

}  // namespace morphbus::bridge
