#pragma once
// Times as people write them on command lines and in files.

#include <optional>
#include <string_view>

namespace morphbus {

/// Seconds: "2.5", "2.5s" or "2500ms". Nothing for any other text, and for what is not finite.
[[nodiscard]] std::optional<double> ReadSeconds(std::string_view text);

}  // namespace morphbus
