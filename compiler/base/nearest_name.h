#pragma once
// The name that was probably meant by one that there is not.

#include <string>
#include <vector>

namespace morphbus {

/// The candidate that differs from `name` in capitals only, else the nearest by edit distance, if
/// near enough to be a likely slip; else "".
[[nodiscard]] std::string NearestName(const std::string& name,
                                      const std::vector<std::string>& candidates);

}  // namespace morphbus
