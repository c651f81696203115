#include "logger/compare/command_pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "compiler/base/text.h"

namespace morphbus::logger {
namespace {

using TickAndText = std::pair<int64_t, std::string>;

/// The first ones, as many as are paired.
std::vector<TickAndText> FirstCommands(const LogFacts& facts) {
  std::vector<TickAndText> first;
  for (const auto& [tick, text] : facts.commands) {
    if (first.size() == kMostPairedCommands) break;
    first.emplace_back(tick, text);
  }
  return first;
}

/// What a pair is worth: one of the same tick counts more than all those of other ticks together.
int PairWorth(const TickAndText& a, const TickAndText& b) {
  if (a.second != b.second) return 0;
  return a.first == b.first ? static_cast<int>(kMostPairedCommands) + 1 : 1;
}

}  // namespace

std::vector<CommandPair> PairCommands(const LogFacts& a, const LogFacts& b) {
  const std::vector<TickAndText> in_a = FirstCommands(a);
  const std::vector<TickAndText> in_b = FirstCommands(b);
  // The worth of the best pairs among the commands from i of A and from k of B on.
  const size_t width = in_b.size() + 1;
  std::vector<int> best((in_a.size() + 1) * width, 0);
  // Filled from the end, since each entry rests on those of later commands.
  for (size_t i = in_a.size(); i-- > 0;) {
    for (size_t k = in_b.size(); k-- > 0;) {
      const int worth = PairWorth(in_a[i], in_b[k]);
      best[i * width + k] = std::max({best[(i + 1) * width + k], best[i * width + k + 1],
                                      worth > 0 ? worth + best[(i + 1) * width + k + 1] : 0});
    }
  }
  // From the front, each step takes a pair where the best way does, else a command of one run.
  std::vector<CommandPair> pairs;
  size_t i = 0, k = 0;
  while (i < in_a.size() || k < in_b.size()) {
    const bool both = i < in_a.size() && k < in_b.size();
    const int worth = both ? PairWorth(in_a[i], in_b[k]) : 0;
    if (worth > 0 && best[i * width + k] == worth + best[(i + 1) * width + k + 1]) {
      pairs.push_back({in_a[i].second, in_a[i].first, in_b[k].first});
      ++i;
      ++k;
      continue;
    }
    // Of two that stand alone at one place the earlier one comes first.
    const bool may_a = i < in_a.size() && best[i * width + k] == best[(i + 1) * width + k];
    const bool may_b = k < in_b.size() && best[i * width + k] == best[i * width + k + 1];
    if (may_a && (!may_b || in_a[i].first <= in_b[k].first)) {
      pairs.push_back({in_a[i].second, in_a[i].first, std::nullopt});
      ++i;
    } else {
      pairs.push_back({in_b[k].second, std::nullopt, in_b[k].first});
      ++k;
    }
  }
  return pairs;
}

bool Differs(const CommandPair& pair, bool by_ticks) {
  // A command that one run lacks differs in any case; other ticks differ only where ticks count.
  if (!pair.tick_a || !pair.tick_b) return true;
  return by_ticks && *pair.tick_a != *pair.tick_b;
}

std::string CommandsNote(const std::vector<CommandPair>& pairs, bool by_ticks) {
  const auto differs = [&](const CommandPair& pair) { return Differs(pair, by_ticks); };
  const auto first = std::find_if(pairs.begin(), pairs.end(), differs);
  if (first == pairs.end()) return "";
  // The first one tells most: what comes after it may follow from it.
  std::string where;
  if (first->tick_a && first->tick_b) {
    where = fmt::format("at tick {} in A and {} in B", *first->tick_a, *first->tick_b);
  } else {
    where = fmt::format("at tick {} only in {}", first->tick_a ? *first->tick_a : *first->tick_b,
                        first->tick_a ? "A" : "B");
  }
  const int64_t more = std::count_if(first + 1, pairs.end(), differs);
  return fmt::format("people gave them different commands: '{}' {}{}", first->text, where,
                     more == 0 ? "" : fmt::format(", and {} more", more));
}

}  // namespace morphbus::logger
