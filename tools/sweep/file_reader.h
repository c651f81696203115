#pragma once
// What the readers of a sweep's file and of a search's have in common.

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compiler/source/toml.h"
#include "tools/sweep/sweep_file.h"

namespace morphbus::tools {

/// A reader of the tree of file number `file`, whose errors go to `diagnostics`.
class FileReader {
 protected:
  FileReader(int file, source::Diagnostics* diagnostics)
      : file_(file), diagnostics_(*diagnostics) {}
  ~FileReader() = default;

  void Wrong(const source::Span& span, std::string message, std::string hint = "") {
    diagnostics_.Error(span, std::move(message)).Hint(std::move(hint));
  }

  /// Reads a whole number from `least` to `most`; what is none is an error, and changes nothing.
  template <typename Number>
  void ReadWhole(const source::TomlEntry& entry, int64_t least, int64_t most, Number* number) {
    const int64_t* value = std::get_if<int64_t>(&entry.value.content);
    if (value == nullptr || *value < least || *value > most) {
      return Wrong(entry.value.span, fmt::format("expected a whole number, {} to {}", least, most));
    }
    *number = static_cast<Number>(*value);
  }

  /// Reads an expression, of which `example` is one; nothing after saying what is wrong with it.
  /// The names in it are kept for CheckNames. Of figures the units are those that names tell.
  std::optional<FigureExpression> ReadExpression(const source::TomlValue& value,
                                                 const char* example = "num_faults == 0");

  /// Finds names in the expressions that are neither figures of a run nor `axes`, nor what a
  /// [[run]] says. Which figures a run has is only known once it has been; misspelt words show
  /// before.
  void CheckNames(const SweepFile& sweep, const std::vector<SweepAxis>& axes);

  int file_;
  source::Diagnostics& diagnostics_;

 private:
  /// Names in expressions, with their places.
  std::vector<std::pair<std::string, source::Span>> named_;
};

}  // namespace morphbus::tools
