#include "compiler/base/quantity.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

namespace morphbus {
namespace {

/// A finite number, and the text behind it.
struct Quantity {
  double number = 0;
  std::string_view unit;
};

std::optional<Quantity> SplitQuantity(std::string_view text) {
  // Unlike strtod, from_chars knows no locale, no blanks and no plus sign, which people may write.
  // A second sign behind the plus, as in "+-2", is no number.
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  Quantity quantity;
  const char* end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, quantity.number);
  // from_chars reads "inf" and "nan", too, which no quantity is.
  if (read.ec != std::errc() || !std::isfinite(quantity.number)) return std::nullopt;
  quantity.unit = {read.ptr, static_cast<size_t>(end - read.ptr)};
  return quantity;
}

}  // namespace

std::optional<double> ReadPlainNumber(std::string_view text) {
  const std::optional<Quantity> quantity = SplitQuantity(text);
  return quantity && quantity->unit.empty() ? std::optional(quantity->number) : std::nullopt;
}

std::optional<double> ReadSeconds(std::string_view text) {
  const std::optional<Quantity> time = SplitQuantity(text);
  if (!time) return std::nullopt;
  if (time->unit.empty() || time->unit == "s") return time->number;
  // Dividing gives the double nearest to the time, which a product with 0.001 does not.
  if (time->unit == "ms") return time->number / 1000;
  return std::nullopt;
}

std::optional<double> ReadRadians(std::string_view text) {
  const std::optional<Quantity> angle = SplitQuantity(text);
  if (!angle) return std::nullopt;
  if (angle->unit.empty() || angle->unit == "rad") return angle->number;
  if (angle->unit == "deg") return angle->number * std::numbers::pi / 180;
  return std::nullopt;
}

std::optional<double> ReadFraction(std::string_view text) {
  const std::optional<Quantity> share = SplitQuantity(text);
  if (!share || !(share->unit.empty() || share->unit == "%")) return std::nullopt;
  const double fraction = share->unit.empty() ? share->number : share->number / 100;
  return fraction >= 0 && fraction <= 1 ? std::optional(fraction) : std::nullopt;
}

std::string MakePlain(const QuantityReader& reader, std::string* text) {
  const std::optional<double> number = reader.read(*text);
  if (!number) return "expected " + std::string(reader.expected) + ", not '" + *text + "'";
  // The shortest text of a double has at most 24 characters.
  std::array<char, 32> digits = {};
  // The shortest text that reads back as the same double, so that nothing is lost on the way
  // through the text.
  char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), *number).ptr;
  text->assign(digits.data(), end);
  return "";
}

}  // namespace morphbus
