#pragma once
// Result<T> carries the errors of bytes, files and messages (CONTRIBUTING.md, four kinds of error).
// User text gets diagnostics instead (compiler/source/diagnostics.h), a running role a fault, and
// our own bugs a MORPHBUS_CHECK (compiler/base/check.h).

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace morphbus {

/// What went wrong, as one sentence a person can act on (no trailing newline).
struct Error {
  /// The sentence; it names the file or the part that is wrong.
  std::string message;
};

/// A value or the reason why there is none. It must be tested (`if (!result)`) before the value is
/// taken; `result.error().message` has the reason.
template <typename T>
using Result = tl::expected<T, Error>;

/// Shorthand for returning a failure: `return Fail("cannot open x.log: No such file");`.
[[nodiscard]] inline tl::unexpected<Error> Fail(std::string message) {
  return tl::unexpected<Error>(Error{std::move(message)});
}

}  // namespace morphbus
