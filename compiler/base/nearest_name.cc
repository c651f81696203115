#include "compiler/base/nearest_name.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace morphbus {
namespace {

/// Optimal string alignment distance: insertions, deletions, replacements and swaps of neighbours.
size_t EditDistance(const std::string& a, const std::string& b) {
  // Only three rows of the table are ever needed, of which the oldest is for swaps.
  std::vector<size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replace = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::string NearestName(const std::string& name, const std::vector<std::string>& candidates) {
  // A slip changes a letter or two; names beyond this length are not typed by hand.
  constexpr size_t kMaxLength = 64;
  if (name.empty() || name.size() > kMaxLength) return "";
  // A name in the wrong capitals is meant, however many letters differ: hinge for HINGE.
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  const auto alike = [&](char a, char b) { return lower(a) == lower(b); };
  for (const std::string& candidate : candidates) {
    if (candidate != name && std::ranges::equal(name, candidate, alike)) return candidate;
  }
  // A third of the letters may differ, and at least one.
  size_t best = std::max<size_t>(1, name.size() / 3) + 1;
  std::string nearest;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > kMaxLength || candidate == name) continue;
    // Names whose lengths alone differ by more need not be compared letter by letter.
    const size_t gap = candidate.size() > name.size() ? candidate.size() - name.size()
                                                      : name.size() - candidate.size();
    if (gap >= best) continue;
    const size_t distance = EditDistance(name, candidate);
    if (distance < best && distance < std::max(name.size(), candidate.size())) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace morphbus
