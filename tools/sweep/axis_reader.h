#pragma once
// The values of one axis of a sweep: from TOML, and from a word of the command line.

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "compiler/source/toml.h"
#include "tools/sweep/sweep_file.h"

namespace morphbus::tools {

/// No axis has more values.
constexpr int64_t kMostValues = 1'000'000;

/// The keys of a table that stands for several values.
inline constexpr std::array<std::string_view, 7> kRangeKeys = {"from", "to",    "step", "count",
                                                               "log",  "whole", "among"};

/// A truth, number or text as JSON; null for anything else.
Json ScalarOf(const source::TomlValue& value);

/// Reads what stands behind `name =`: one value, a list, or a table: {from, to, step}, {from, to,
/// count} (both ends are in it), {from, to} of which samples are drawn, {among = [ … ]}; with log =
/// true the numbers are spread evenly by their logarithms. `input` is null for a setting, whose
/// values may be of any kind: of one that goes from whole numbers on by whole steps they are whole
/// numbers, as its program or model may want them. Nothing if something is wrong, which
/// `diagnostics` then says.
std::optional<SweepAxis> ReadAxis(const std::string& name, const RunInput* input,
                                  const source::TomlValue& value, source::Diagnostics* diagnostics);

/// What a word of the command line says behind `NAME=`, as if it stood in the file: "10,20,30" is a
/// list, "10..60:5" steps, "10..60" a range, and every other text one value. `at` is where `text`
/// begins in file number `file`.
source::TomlValue ValueOfWord(std::string_view text, int file, size_t at);

/// count numbers from `from` on, by `step`: computed as decimal fractions where the two are such,
/// so that 0.1, 0.2, 0.3 are the numbers of these names.
std::vector<double> Steps(double from, double step, int64_t count);

}  // namespace morphbus::tools
