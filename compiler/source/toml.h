#pragma once
// TOML texts (https://toml.io, by toml++) as a tree of values that know where they stand, so that
// whoever reads one can name the place of what is wrong with it.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "compiler/source/diagnostics.h"

namespace morphbus::source {

struct TomlEntry;

/// One value of a TOML text. Tables keep the order of the text.
struct TomlValue {
  using Array = std::vector<TomlValue>;
  using Table = std::vector<TomlEntry>;
  /// Nothing stands for a date or a time, which no file of ours has.
  std::variant<std::monostate, bool, int64_t, double, std::string, Array, Table> content;
  Span span;

  [[nodiscard]] bool is_number() const {
    return std::holds_alternative<int64_t>(content) || std::holds_alternative<double>(content);
  }
  /// A number of either type; nothing for what is none.
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] const std::string* text() const { return std::get_if<std::string>(&content); }
  [[nodiscard]] const Array* array() const { return std::get_if<Array>(&content); }
  [[nodiscard]] const Table* table() const { return std::get_if<Table>(&content); }
};

/// A key of a table, and its value.
struct TomlEntry {
  std::string key;
  Span key_span;
  TomlValue value;
};

/// Reads file number `file` of `sources`. A text that is no TOML has one error, with its place, and
/// no tree.
std::optional<TomlValue::Table> ParseToml(const SourceSet& sources, int file,
                                          Diagnostics* diagnostics);

}  // namespace morphbus::source
