#pragma once
// Small texts for people: counts with their nouns, hashes, times, cells of tables, and text from
// outside made safe for a terminal.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus {

/// A count with its noun: "1 fault", "2 faults". `many` is the plural where it is not `one` with an
/// s: Counted(2, "body", "bodies").
[[nodiscard]] std::string Counted(int64_t count, std::string_view one, std::string_view many = {});

/// "a, b, c"; of more than `most` names the first ones "and 1234 more", so that no reader takes the
/// list for the whole.
[[nodiscard]] std::string NameFirst(const std::vector<std::string>& names, size_t most);

/// `value` in lower-case hexadecimal with at least `digits` digits and no prefix. Hashes are
/// written with 16.
[[nodiscard]] std::string Hex(uint64_t value, int digits = 16);

/// A text as a cell of a CSV table (RFC 4180): in quotation marks if it holds what separates cells.
[[nodiscard]] std::string CsvCell(std::string_view text);

/// Microseconds, the unit of time of messages and logs, as seconds.
[[nodiscard]] constexpr double Seconds(int64_t us) { return static_cast<double>(us) * 1e-6; }

/// `text` with everything made visible that could steer a terminal or hide other text. Names of
/// channels and roles, reasons and faults come from other processes and from damaged logs, and go
/// through here before they are printed. Newline, carriage return and tab become `\n`, `\r`, `\t`;
/// other C0 characters (ESC among them), DEL, and bytes that are not UTF-8 become `\x1b`; C1
/// characters, line separators and marks of writing direction become `\u009b`. Printable UTF-8 and
/// the backslash stay as they are, so the result is for reading only and cannot be turned back.
[[nodiscard]] std::string EscapeControl(std::string_view text);

}  // namespace morphbus
