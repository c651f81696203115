#include "compiler/base/duration.h"

#include <charconv>
#include <cmath>

namespace morphbus {

std::optional<double> ReadSeconds(std::string_view text) {
  // Unlike strtod, from_chars knows no locale, no blanks and no plus sign.
  double number = 0;
  const char* end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, number);
  if (read.ec != std::errc() || !std::isfinite(number)) return std::nullopt;
  const std::string_view unit(read.ptr, static_cast<size_t>(end - read.ptr));
  if (unit.empty() || unit == "s") return number;
  // Dividing gives the double nearest to the time, which a product with 0.001 does not.
  if (unit == "ms") return number / 1000;
  return std::nullopt;
}

}  // namespace morphbus
