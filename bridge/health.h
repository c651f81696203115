#pragma once
// HEALTH: a process's ledger and resources, once a second of wall time.

#include <morphbus/health_t.hpp>
#include <string>

#include "bridge/bus.h"

namespace morphbus::bridge {

/// Ledger, largest resident set, processor time and wall clock; the header is left to the outbox.
morphbus::health_t MakeHealth(const std::string& process, const Ledger& ledger);

}  // namespace morphbus::bridge
