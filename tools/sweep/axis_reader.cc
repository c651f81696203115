#include "tools/sweep/axis_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "compiler/base/quantity.h"

namespace morphbus::tools {
namespace {

/// Reads one axis.
class AxisReader {
 public:
  AxisReader(const RunInput* input, source::Diagnostics* diagnostics)
      : input_(input), diagnostics_(*diagnostics) {}

  std::optional<SweepAxis> Read(const std::string& name, const source::TomlValue& value) {
    SweepAxis axis;
    axis.name = name;
    axis.span = value.span;
    if (const source::TomlValue::Array* list = value.array()) {
      if (!ReadList(*list, value.span, &axis)) return std::nullopt;
    } else if (const source::TomlValue::Table* table = value.table()) {
      if (!ReadTable(*table, value.span, &axis)) return std::nullopt;
    } else {
      const std::optional<Json> one = ReadScalar(value);
      if (!one) return std::nullopt;
      axis.values = {*one};
    }
    return axis;
  }

 private:
  /// Reports an error; false, for return statements.
  bool Wrong(const source::Span& span, std::string message, std::string hint = "") {
    diagnostics_.Error(span, std::move(message)).Hint(std::move(hint));
    return false;
  }

  std::optional<Json> ReadScalar(const source::TomlValue& value) {
    const Json scalar = ScalarOf(value);
    if (scalar.is_null()) {
      return diagnostics_.Error(value.span, "expected a number, a text, true or false");
    }
    const Result<Json> checked =
        input_ != nullptr ? CheckedInput(*input_, scalar) : Result<Json>(scalar);
    if (!checked) return diagnostics_.Error(value.span, checked.error().message);
    return *checked;
  }

  bool ReadList(const source::TomlValue::Array& list, const source::Span& span, SweepAxis* axis) {
    if (list.empty()) return Wrong(span, "the list is empty, so that nothing would run");
    for (const source::TomlValue& item : list) {
      const std::optional<Json> value = ReadScalar(item);
      if (!value) return false;
      // Rows are named by their values.
      if (std::ranges::find(axis->values, *value) != axis->values.end()) {
        return Wrong(item.span, fmt::format("{} stands in the list twice", PlainText(*value)));
      }
      axis->values.push_back(*value);
    }
    return true;
  }

  bool ReadTable(const source::TomlValue::Table& table, const source::Span& span, SweepAxis* axis) {
    // Which keys there are decides what the table is.
    std::array<const source::TomlEntry*, kRangeKeys.size()> found = {};
    for (const source::TomlEntry& entry : table) {
      const auto key = std::ranges::find(kRangeKeys, entry.key);
      if (key == kRangeKeys.end()) {
        return Wrong(entry.key_span, fmt::format("there is no '{}' of several values", entry.key),
                     source::NearestHint(entry.key, {kRangeKeys.begin(), kRangeKeys.end()},
                                         "there are from, to, step, count, log, whole and among"));
      }
      found[key - kRangeKeys.begin()] = &entry;
    }
    // In the order of kRangeKeys; null for those that are not there.
    const auto [from, to, step, count, log, whole, among] = found;
    if (among != nullptr) {
      const source::TomlValue::Array* list = among->value.array();
      if (list == nullptr) return Wrong(among->value.span, "expected a list: among = [1, 2, 3]");
      if (table.size() > 1) return Wrong(span, "'among' stands alone");
      axis->kind = SweepAxis::Kind::kAmong;
      return ReadList(*list, among->value.span, axis);
    }
    if (from == nullptr || to == nullptr) {
      return Wrong(span, "expected {from = …, to = …, step = …}, or count in the place of step");
    }
    return ReadEnds(*from, *to, axis) && ReadTruth(log, &axis->logarithmic) &&
           ReadTruth(whole, &axis->whole) && ReadSteps(step, count, span, axis);
  }

  bool ReadTruth(const source::TomlEntry* entry, bool* truth) {
    if (entry == nullptr) return true;
    const bool* value = std::get_if<bool>(&entry->value.content);
    if (value == nullptr) return Wrong(entry->value.span, "expected true or false");
    *truth = *value;
    return true;
  }

  bool ReadEnds(const source::TomlEntry& from, const source::TomlEntry& to, SweepAxis* axis) {
    for (const auto& [entry, end] : {std::pair(&from, &axis->from), std::pair(&to, &axis->to)}) {
      const std::optional<double> number = entry->value.number();
      if (!number || !std::isfinite(*number)) return Wrong(entry->value.span, "expected a number");
      *end = *number;
    }
    written_whole_ = IsWhole(from) && IsWhole(to);
    if (axis->from < axis->to) return true;
    return Wrong(to.value.span, fmt::format("expected more than {}, where it begins", axis->from));
  }

  /// Whether a number is written without a point.
  static bool IsWhole(const source::TomlEntry& entry) {
    return std::holds_alternative<int64_t>(entry.value.content);
  }

  /// A range, or the numbers that are in it.
  bool ReadSteps(const source::TomlEntry* step, const source::TomlEntry* count,
                 const source::Span& span, SweepAxis* axis) {
    if (axis->logarithmic && !(axis->from > 0)) {
      return Wrong(span, "of what is not above 0 there is no logarithm: leave out log");
    }
    if (step != nullptr && count != nullptr) return Wrong(span, "expected step or count, not both");
    std::vector<double> numbers;
    if (step != nullptr) {
      if (axis->logarithmic) return Wrong(span, "with log expected count in the place of step");
      const double width = step->value.number().value_or(0);
      if (!(width > 0)) return Wrong(step->value.span, "expected a number above 0");
      // A step that meets the end but for rounding meets it.
      const double steps = std::floor((axis->to - axis->from) / width * (1 + 1e-12)) + 1;
      if (!(steps <= kMostValues)) return TooMany(step->value.span);
      written_whole_ = written_whole_ && IsWhole(*step);
      numbers = Steps(axis->from, width, static_cast<int64_t>(steps));
    } else if (count != nullptr) {
      const int64_t* wanted = std::get_if<int64_t>(&count->value.content);
      if (wanted == nullptr || *wanted < 2) {
        return Wrong(count->value.span, "expected a whole number, 2 or more");
      }
      if (*wanted > kMostValues) return TooMany(count->value.span);
      numbers = Spread(*axis, *wanted);
    } else {
      axis->kind = SweepAxis::Kind::kRange;
      numbers = {axis->from, axis->to};
      if (axis->whole && std::ceil(axis->from) > std::floor(axis->to)) {
        return Wrong(span, "there is no whole number in it");
      }
    }
    return TakeNumbers(numbers, span, axis);
  }

  bool TooMany(const source::Span& span) {
    return Wrong(span, fmt::format("more than {} values", kMostValues));
  }

  /// `count` numbers from end to end.
  static std::vector<double> Spread(const SweepAxis& axis, int64_t count) {
    std::vector<double> numbers;
    for (int64_t i = 0; i < count; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(count - 1);
      const double exact =
          axis.logarithmic ? std::exp(std::log(axis.from) * (1 - part) + std::log(axis.to) * part)
                           : axis.from * (1 - part) + axis.to * part;
      // Twelve digits, so that 0.1 between 0.01 and 1 is the number of that name.
      numbers.push_back(ReadNumber<double>(fmt::format("{:.12g}", exact)).value_or(exact));
    }
    // The ends are what the file says.
    numbers.front() = axis.from;
    numbers.back() = axis.to;
    return numbers;
  }

  /// Checks the numbers; those of an axis that is gone through are its values.
  bool TakeNumbers(const std::vector<double>& numbers, const source::Span& span, SweepAxis* axis) {
    axis->whole = axis->whole || (input_ != nullptr && input_->kind == RunInput::Kind::kWhole);
    const bool each = axis->kind == SweepAxis::Kind::kEach;
    for (const double number : numbers) {
      const double taken = axis->whole ? std::round(number) : number;
      // Who knows the setting decides about its type. A program takes 3, and not 3.0, for an int,
      // and 3 also for a float; so what can be written without a point is.
      const bool whole = axis->whole || (input_ == nullptr && each && written_whole_);
      const bool fits = std::abs(taken) <= 0x1p53 && taken == std::round(taken);
      const Json value = whole && fits ? Json(static_cast<int64_t>(taken)) : Json(taken);
      const Result<Json> checked =
          input_ != nullptr ? CheckedInput(*input_, value) : Result<Json>(value);
      if (!checked) return Wrong(span, checked.error().message);
      const bool again = !axis->values.empty() && axis->values.back() == *checked;
      if (each && !again) axis->values.push_back(*checked);
    }
    return true;
  }

  /// Null for a setting.
  const RunInput* input_;
  source::Diagnostics& diagnostics_;
  /// The ends of the range, and its step, are written as whole numbers.
  bool written_whole_ = false;
};

/// Decimals that a number has when it is written as short as it can be; more than 9 count as 10.
int DecimalsOf(double number) {
  double scaled = number;
  double power = 1;
  for (int decimals = 0; decimals < 10; ++decimals) {
    scaled = std::round(number * power);
    if (std::abs(scaled) < 0x1p50 && scaled / power == number) return decimals;
    power *= 10;
  }
  return 10;
}

}  // namespace

Json ScalarOf(const source::TomlValue& value) {
  if (const bool* truth = std::get_if<bool>(&value.content)) return *truth;
  if (const int64_t* whole = std::get_if<int64_t>(&value.content)) return *whole;
  if (const double* real = std::get_if<double>(&value.content)) {
    // JSON has no infinity.
    return std::isfinite(*real) ? Json(*real) : Json(nullptr);
  }
  return value.text() != nullptr ? Json(*value.text()) : Json(nullptr);
}

std::optional<SweepAxis> ReadAxis(const std::string& name, const RunInput* input,
                                  const source::TomlValue& value,
                                  source::Diagnostics* diagnostics) {
  return AxisReader(input, diagnostics).Read(name, value);
}

source::TomlValue ValueOfWord(std::string_view text, int file, size_t at) {
  source::TomlValue value;
  value.span = {file, at, at + text.size()};
  // Parts with their places, as if they stood in a file.
  const auto scalar = [file, at, text](std::string_view part) {
    source::TomlValue one;
    const size_t begin = at + static_cast<size_t>(part.data() - text.data());
    one.span = {file, begin, begin + part.size()};
    if (const auto whole = ReadNumber<int64_t>(part)) {
      one.content = *whole;
    } else if (const auto real = ReadNumber<double>(part)) {
      one.content = *real;
    } else if (part == "true" || part == "false") {
      one.content = part == "true";
    } else {
      one.content = std::string(part);
    }
    return one;
  };
  // Commas make a list, of one kind of thing or of several.
  if (text.find(',') != std::string_view::npos) {
    source::TomlValue::Array list;
    for (size_t begin = 0; begin <= text.size();) {
      const size_t end = std::min(text.find(',', begin), text.size());
      list.push_back(scalar(text.substr(begin, end - begin)));
      begin = end + 1;
    }
    value.content = std::move(list);
    return value;
  }
  // A path may have two points, too: a range has numbers.
  const size_t points = text.find("..");
  const std::string_view from = text.substr(0, points);
  if (points != std::string_view::npos && ReadNumber<double>(from)) {
    const size_t colon = std::min(text.find(':', points), text.size());
    source::TomlValue::Table table;
    const auto add = [&](const char* key, std::string_view part) {
      table.push_back({key, value.span, scalar(part)});
    };
    add("from", from);
    add("to", text.substr(points + 2, colon - points - 2));
    if (colon < text.size()) add("step", text.substr(colon + 1));
    value.content = std::move(table);
    return value;
  }
  return scalar(text);
}

std::vector<double> Steps(double from, double step, int64_t count) {
  const int decimals = std::max(DecimalsOf(from), DecimalsOf(step));
  const double power = std::pow(10.0, decimals);
  std::vector<double> numbers;
  for (int64_t i = 0; i < count; ++i) {
    // Whole numbers below 2^53 are exact, and a quotient is the double nearest to it.
    const double exact =
        std::round(from * power) + std::round(step * power) * static_cast<double>(i);
    const bool decimal = decimals < 10 && std::abs(exact) < 0x1p53;
    numbers.push_back(decimal ? exact / power : from + step * static_cast<double>(i));
  }
  return numbers;
}

}  // namespace morphbus::tools
