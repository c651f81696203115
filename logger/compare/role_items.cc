// The part of PairComparer (pair_comparer.h) that compares which roles two modules took, and when.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "logger/compare/pair_comparer.h"

namespace morphbus::logger {
namespace {

/// Of sim times: later than all that there are.
constexpr int64_t kNoTime_us = std::numeric_limits<int64_t>::max();

/// When a module first reported that its role is frozen, sim time in µs.
std::optional<int64_t> FrozenSince(const ModuleSeries& module) {
  for (const StatusSample& sample : module.status) {
    if (sample.status.frozen != 0) return sample.time_us;
  }
  return std::nullopt;
}

}  // namespace

/// A module whose role flickered stays in it for good, whatever its neighbours become.
void PairComparer::CompareFreezing(const Subject& modules, Item* item) {
  const std::optional<int64_t> a = FrozenSince(modules.a);
  const std::optional<int64_t> b = FrozenSince(modules.b);
  if (!a && !b) return;
  const int64_t begin_us = std::min(a.value_or(kNoTime_us), b.value_or(kNoTime_us));
  if (begin_us > out_.compared_until_us || item->first_over_us >= 0) return;
  Meter meter(item);
  if (a && b) return meter.Add(begin_us, Seconds(std::abs(*a - *b)));
  item->detail = fmt::format("only {} is frozen in its role", a ? "A" : "B");
  meter.Add(begin_us,
            std::max(Seconds(out_.compared_until_us - begin_us), 2 * item->tolerance + 1e-6));
}

void PairComparer::CompareRole(const Subject& modules) {
  const ModulePair& pair = modules.pair;
  Item& item = AddItem(modules.names, Quantity::kRole, "s");
  {
    // The n-th role of one must be the n-th of the other, taken at the same time.
    Meter meter(&item);
    const size_t common = std::min(pair.spans_a.size(), pair.spans_b.size());
    for (size_t i = 0; i < common; ++i) {
      const RoleSpan& a = pair.spans_a[i];
      const RoleSpan& b = pair.spans_b[i];
      const int64_t begin = std::min(a.begin_us, b.begin_us);
      if (a.role != b.role) {
        item.detail = fmt::format("'{}' against '{}'", a.role, b.role);
        meter.Add(begin, std::max(Seconds(out_.compared_until_us - begin), 2 * item.tolerance));
        break;
      }
      // By event, that a role is taken is what tells the time.
      const bool timed = by_ticks_ || out_.alignment.how != Align::kEvent;
      meter.Add(begin, timed ? Seconds(std::abs(a.begin_us - b.begin_us)) : 0.0);
    }
    // One of them may take further roles after the last one that both took.
    if (item.first_over_us < 0 && pair.spans_a.size() != pair.spans_b.size()) {
      const auto& longer = pair.spans_a.size() > common ? pair.spans_a : pair.spans_b;
      const RoleSpan& extra = longer[common];
      item.detail = fmt::format("only {} goes on to '{}'", pair.spans_a.size() > common ? "A" : "B",
                                extra.role);
      const double since = Seconds(out_.compared_until_us - extra.begin_us);
      meter.Add(extra.begin_us, std::max(since, 2 * item.tolerance));
    }
  }
  CompareFreezing(modules, &item);
  // A label that only one of them resolved.
  for (const auto& [missing, which] :
       {std::pair(&pair.labels_missing_a, "A"), std::pair(&pair.labels_missing_b, "B")}) {
    for (const std::string& label : *missing) {
      Item& lacking = AddItem(SubjectOf(pair, label).names, Quantity::kRole, "s", true);
      lacking.detail = fmt::format("{} did not resolve the label", which);
      Meter(&lacking).Add(std::max(pair.taken_a_us, pair.taken_b_us),
                          Seconds(out_.compared_until_us));
    }
  }
}

}  // namespace morphbus::logger
