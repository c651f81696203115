#include "tools/spy/field_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace morphbus::tools {
namespace {

/// A value that holds no others, as text.
std::string ValueText(const Json& value) {
  return value.is_number_float() ? fmt::format("{:.6g}", value.get<double>()) : JsonText(value);
}

/// The value as a number for its history; not a number if it is none now.
double NumberOf(const Json& value) {
  if (value.is_boolean()) return value.get<bool>() ? 1.0 : 0.0;
  if (!value.is_number()) return std::numeric_limits<double>::quiet_NaN();
  return value.get<double>();
}

}  // namespace

void FieldHistory::Walk(const Json& value, const std::string& path) {
  // Members and elements are fields by themselves, under their path.
  if (value.is_object()) {
    for (const auto& [name, member] : value.items()) {
      Walk(member, path.empty() ? name : path + "." + name);
    }
    return;
  }
  // An array of nothing is a field all the same.
  if (value.is_array() && !value.empty()) {
    for (size_t i = 0; i < value.size(); ++i) Walk(value[i], fmt::format("{}[{}]", path, i));
    return;
  }
  // A message of a million numbers is not shown whole.
  if (fields_.size() >= kMostFields) {
    ++more_;
    return;
  }
  fields_.push_back({path, value.is_array() ? "[]" : ValueText(value), NumberOf(value), {}});
}

void FieldHistory::Take(const Json& message) {
  fields_.clear();
  more_ = 0;
  Walk(message, "");
  // Every message of ours begins with the same header, which nobody opens a channel for.
  if (message.contains("header") && message["header"].contains("crc32")) {
    std::stable_partition(fields_.begin(), fields_.end(),
                          [](const FieldRow& field) { return !field.path.starts_with("header."); });
  }
  // Histories go over to the fields of this message; those of others end.
  std::map<std::string, std::vector<double>> before = std::exchange(histories_, {});
  for (FieldRow& field : fields_) {
    if (histories_.size() >= kMostHistories) break;
    if (std::isnan(field.number)) continue;
    std::vector<double>& history = histories_[field.path];
    // A field keeps its history as long as every message has it.
    const auto known = before.find(field.path);
    if (known != before.end()) history = std::move(known->second);
    if (history.size() >= kMostValues) history.erase(history.begin());
    history.push_back(field.number);
    field.history = history;
  }
}

}  // namespace morphbus::tools
