#pragma once
// Result<T>: the error tier for bytes, files and messages (docs/design notes in CONTRIBUTING.md).
// User text gets diagnostics (compiler/source/diagnostics.h) instead; our own bugs get a check.

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace morphbus {

/// What went wrong, as one sentence a person can act on (no trailing newline).
struct Error {
  std::string message;
};

/// A value or the reason why there is none.
template <typename T>
using Result = tl::expected<T, Error>;

/// Shorthand for returning a failure: `return Fail("cannot open x.log: No such file");`.
[[nodiscard]] inline tl::unexpected<Error> Fail(std::string message) {
  return tl::unexpected<Error>(Error{std::move(message)});
}

}  // namespace morphbus
