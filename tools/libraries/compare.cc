#include <morphbus/compare/compare.h>

#include <nlohmann/json.hpp>

#include "logger/compare/comparer.h"
#include "tools/libraries/log_content.h"
#include "tools/libraries/model_content.h"

namespace morphbus {
namespace {

/// The tolerance that is so called. Throws Failure where there is none, or the value is none.
logger::ToleranceEntry Tolerance(const std::string& name, const std::string& value) {
  std::vector<std::string> names;
  for (const auto& [known, member] : logger::ToleranceNames()) {
    names.push_back(known);
    if (known != name) continue;
    const Result<double> number = logger::ReadTolerance(name, value);
    if (!number) throw Failure(name + ": " + number.error().message);
    return {"*", "*", member, *number};
  }
  ThrowUnknown("tolerance", name, names);
}

logger::CompareOptions ToInternal(const CompareOptions& options) {
  logger::CompareOptions told;
  told.level = options.gait ? logger::Level::kGait : logger::Level::kSample;
  told.align = static_cast<logger::Align>(options.alignment);
  for (const auto& [name, value] : options.tolerances) {
    told.tolerances.push_back(Tolerance(name, value));
  }
  return told;
}

double SecondsOf(int64_t time_us) { return static_cast<double>(time_us) / 1e6; }

ComparedItem ToPublic(const logger::Item& item) {
  return {logger::QuantityName(item.quantity),
          item.role,
          item.label,
          item.module_a,
          item.module_b,
          item.unit,
          item.samples,
          item.max,
          item.rms,
          item.tolerance,
          SecondsOf(item.max_time_us),
          item.first_over_us < 0 ? -1.0 : SecondsOf(item.first_over_us)};
}

}  // namespace

Comparison CompareLogs(const Log& a, const Log& b, const CompareOptions& options) {
  const logger::Comparison found =
      logger::Compare(a.content()->log, b.content()->log, ToInternal(options));
  Comparison comparison;
  comparison.verdict = static_cast<Verdict>(found.verdict);
  comparison.reason = found.reason;
  for (const logger::Item& item : found.items) comparison.items.push_back(ToPublic(item));
  if (found.first) comparison.first = static_cast<int>(*found.first);
  comparison.notes = found.notes;
  comparison.text = logger::ComparisonText(found, false);
  comparison.json =
      logger::ComparisonJson(found).dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  return comparison;
}

}  // namespace morphbus
