#pragma once
// The state of a lockstep machine as bytes, for tests that explore every order of events and must
// know which states they have been in.

#include <charconv>
#include <cstdint>
#include <ranges>
#include <string>
#include <type_traits>
#include <utility>

namespace morphbus::bridge {

/// Adds a number, flag or enum to the text. Texts are kept by the hundred thousand while a test
/// explores, and a state is mostly flags, so a flag takes one character; a number ends with a
/// comma, so that it cannot run on into the next one.
template <class T>
void AddPrint(const T& part, std::string* print) {
  if constexpr (std::is_same_v<T, bool>) {
    *print += part ? '1' : '0';
  } else {
    char digits[24];
    char* end = std::to_chars(digits, digits + 20, static_cast<int64_t>(part)).ptr;
    *end++ = ',';
    print->append(digits, end);
  }
}
/// Adds both parts of an entry of a map.
template <class A, class B>
void AddPrint(const std::pair<A, B>& part, std::string* print);
/// Adds every element, with marks where they begin and end.
template <std::ranges::range Range>
void AddPrint(const Range& parts, std::string* print) {
  *print += '[';
  for (const auto& part : parts) AddPrint(part, print);
  *print += ']';
}
template <class A, class B>
void AddPrint(const std::pair<A, B>& part, std::string* print) {
  AddPrint(part.first, print);
  AddPrint(part.second, print);
}

/// Adds whatever decides what a machine does next, times excepted: states with equal texts need
/// exploring only once. The parts are numbers, flags, enums, and ranges and pairs of these. Texts
/// are made by the million, hence one that grows.
template <class... Parts>
void AddPrints(std::string* print, const Parts&... parts) {
  (AddPrint(parts, print), ...);
}

}  // namespace morphbus::bridge
