#pragma once
// Lines of text for a terminal, as `info`, `verify` and `compare` print them. JSON escapes by
// itself and does not come through here.

#include <fmt/format.h>

#include <numbers>
#include <string>
#include <utility>

#include "compiler/base/text.h"

namespace morphbus::logger {

/// Degrees in a radian: people are told degrees.
inline constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Appends a line, formatted as fmt::format does, and its line feed to `text`. Names, roles,
/// reasons and faults of a log may hold any bytes: whatever could steer the terminal is made
/// visible here, so that nobody else needs to think of it. A value with a line feed therefore stays
/// on the one line. The format is checked when it is compiled, so it never fails.
template <class... T>
void AddLine(std::string* text, fmt::format_string<T...> format, T&&... values) {
  *text += EscapeControl(fmt::format(format, std::forward<T>(values)...)) + "\n";
}

}  // namespace morphbus::logger
