#pragma once
// Which names a user means by a regular expression, as `--channel` takes one. The standard
// library's templates are compiled once, in name_pattern.cc: they take seconds in every file that
// uses them.

#include <memory>
#include <string>
#include <string_view>

#include "compiler/base/result.h"

namespace morphbus {

/// An ECMAScript regular expression that a whole name must match. Copies share it.
class NamePattern {
 public:
  /// An empty text means every name. Fails with what is wrong if `text` is no regular expression.
  static Result<NamePattern> Parse(const std::string& text);

  /// True if the expression matches the name as a whole, and not only a part of it.
  [[nodiscard]] bool Matches(std::string_view name) const;

 private:
  /// The compiled expression, whose type only name_pattern.cc knows.
  struct Compiled;
  explicit NamePattern(std::shared_ptr<const Compiled> compiled);

  std::shared_ptr<const Compiled> compiled_;  // null: every name
};

}  // namespace morphbus
