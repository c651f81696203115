#pragma once
// Mutations of M3L text that know its structure: they move, copy and change statements, tokens and
// parenthesised groups, so that most results get past the parser and into the checker and solver.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace morphbus::test {

/// A mutation of `text` of at most `max_size` bytes; the same `seed` gives the same result. Any
/// text is good, also what is not M3L.
std::string MutateM3l(std::string_view text, uint32_t seed, size_t max_size);

/// A text with statements of both.
std::string CrossM3l(std::string_view a, std::string_view b, uint32_t seed, size_t max_size);

}  // namespace morphbus::test
