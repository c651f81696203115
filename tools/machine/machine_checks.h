#pragma once
// Whether this machine can carry a run: what `morphbus doctor` looks at. Every finding that is not
// in order comes with the one command that mends it.
//
// What LCM's users meet most is multicast without a route, a receive buffer that the kernel cuts
// silently, and traffic on another interface than they think (lcm issues 60, 323, 365).

#include <string>
#include <vector>

#include "bridge/bus/lcm_url.h"
#include "tools/machine/machine_findings.h"

namespace morphbus::tools {

/// Looks at everything that a run on the bus of `url` needs from this machine: `url`, `route`,
/// `interface`, `loop` (what is sent is heard), `buffer`, `files`, `processes`, `namespaces`,
/// `clock`, `timer`, in this order. Publishes nothing on the bus: what is sent to see whether it
/// arrives goes to another port. `url_from` says where the URL comes from. Takes about 0.1 s.
std::vector<Finding> CheckMachine(const bridge::LcmUrl& url, const std::string& url_from);

}  // namespace morphbus::tools
