#pragma once
// Times, angles and fractions as people write them on command lines and in files: a number, and
// behind it, if they like, its unit. There is nothing between the two.

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace morphbus {

/// The whole text as a number of a type, such as "12"; of an integer in this base. Nothing for
/// another text, for a number that the type does not hold, and for one that is not finite. Unlike
/// strtod this knows no locale, no blanks and no plus sign.
template <class Number>
[[nodiscard]] std::optional<Number> ReadNumber(std::string_view text, int base = 10) {
  Number number = 0;
  const char* end = text.data() + text.size();
  std::from_chars_result read = {};
  if constexpr (std::is_floating_point_v<Number>) {
    read = std::from_chars(text.data(), end, number);
    if (!std::isfinite(number)) return std::nullopt;
  } else {
    read = std::from_chars(text.data(), end, number, base);
  }
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return number;
}

/// A finite number alone, "2.5", of a quantity that is written without its unit; nothing for
/// another text. As with all quantities, which people write, a plus sign may stand before it.
[[nodiscard]] std::optional<double> ReadPlainNumber(std::string_view text);

/// Seconds: "2.5", "2.5s" or "2500ms". Nothing for any other text, and for what is not finite.
[[nodiscard]] std::optional<double> ReadSeconds(std::string_view text);

/// Radians: "0.5", "0.5rad" or "30deg". Nothing for any other text, and for what is not finite.
[[nodiscard]] std::optional<double> ReadRadians(std::string_view text);

/// A fraction: "0.2" or "20%". Nothing for any other text, and outside of 0 to 1: a "20" alone is
/// refused, for it may be meant as 20 %.
[[nodiscard]] std::optional<double> ReadFraction(std::string_view text);

/// A way to read quantities, and for people what it expects: "a fraction, 0 to 1, such as …".
struct QuantityReader {
  /// One of the readers above.
  std::optional<double> (*read)(std::string_view text);
  std::string_view expected;
};
inline constexpr QuantityReader kSecondsReader = {ReadSeconds,
                                                  "seconds, such as 2.5, 2.5s or 200ms"};
inline constexpr QuantityReader kFractionReader = {ReadFraction,
                                                   "a fraction, 0 to 1, such as 0.2 or 20%"};

/// Leaves of the text the plain number that it says, for a reader of options that knows no units.
/// Returns what is wrong with it, and then leaves it alone; "" if nothing is.
[[nodiscard]] std::string MakePlain(const QuantityReader& reader, std::string* text);

}  // namespace morphbus
