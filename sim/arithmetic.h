#pragma once

#include <string>
#include <string_view>

namespace morphbus::sim {

/// The fingerprint of every machine that computes as IEEE 754 says, with a Bullet whose operations
/// are not contracted: all of amd64 with Debian's Bullet 3.24. test/golden demands it, too.
inline constexpr std::string_view kUsualArithmetic = "8d439298440ddb71";

/// Fingerprint of all arithmetic that can reach a run's payloads or its world, 16 hex digits: what
/// every process computes (bridge::ArithmeticHash), the elementary functions, and a small world of
/// Bullet's own, with a driven hinge and contacts, stepped a hundred times. Two machines or builds
/// with one fingerprint give a run one hash (docs/arithmetic.md); no option of Morphbus enters it.
/// Computed once, in some 2 ms.
const std::string& ArithmeticFingerprint();

}  // namespace morphbus::sim
