#pragma once
// Networks for a run: one of its own, another run's, or the machine's, if that can carry it.

#include <sys/types.h>

#include <string>

#include "compiler/base/result.h"
#include "tools/machine/run_registry.h"

namespace morphbus::tools {

/// Moves this process, and what it starts from now on, into a network namespace of its own that
/// holds just a loopback with a multicast route. Needs no rights: an unprivileged user gets a user
/// namespace as well (with unchanged ids). Call before any thread is started.
Result<void> EnterPrivateNetwork();

/// Moves this process into the network namespace of process `pid` (a run of one's own).
/// Call before any thread is started.
Result<void> JoinNetworkOf(pid_t pid);
/// The same for a run: nothing is to be done unless it has a private network, whose bus is out of
/// reach of all who are not in it.
Result<void> JoinNetworkOf(const RunEntry& run);

}  // namespace morphbus::tools
