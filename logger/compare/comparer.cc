#include "logger/compare/comparer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "logger/compare/pair_comparer.h"

namespace morphbus::logger {
namespace {

/// Nothing is missing, and END says that the run ended as it should.
bool Complete(const RunLog& log) { return log.facts.whole() && log.facts.end->clean; }

/// One comparison in progress: Run() goes through its steps once, and the result is moved out.
class Comparer {
 public:
  Comparer(const RunLog& a, const RunLog& b, const CompareOptions& options)
      : a_(a), b_(b), options_(options) {}

  /// Takes the steps in their order. Logs that lack a model or ticks get their reason from Usable()
  /// and no items.
  Comparison Run() {
    out_.a = a_.facts;
    out_.b = b_.facts;
    if (!Usable()) return std::move(out_);
    FindEnd();
    NoteDamage(a_, "A");
    NoteDamage(b_, "B");
    for (const std::string& group : options_.without) {
      // What the user left out must be seen in the result.
      out_.notes.push_back("left out of the comparison: " + group);
    }
    CompareModules();
    Decide();
    return std::move(out_);
  }

 private:
  /// Without a model and a tick there is nothing to compare.
  bool Usable() {
    // The reason names the log: of two paths a reader would not know which one lacks something.
    for (const auto& [log, which] : {std::pair(&a_, "A"), std::pair(&b_, "B")}) {
      if (log->model == nullptr || log->robot == nullptr) {
        out_.reason = fmt::format(
            "{} ({}) does not say which robot it shows: {}", which, log->facts.path,
            log->facts.problems.empty() ? "no description" : log->facts.problems.front());
        return false;
      }
      if (log->ticks_us.empty()) {
        out_.reason = fmt::format("{} ({}) holds no control tick", which, log->facts.path);
        return false;
      }
    }
    return true;
  }

  /// Until when both logs can be trusted and have something to say.
  void FindEnd() {
    // Damage is dated by the sim time up to which the log was whole.
    int64_t end = std::min(a_.ticks_us.back(), b_.ticks_us.back());
    for (const RunLog* log : {&a_, &b_}) {
      for (const LogDamage& damage : log->facts.damage) end = std::min(end, damage.time_us);
    }
    out_.compared_until_us = end;
  }

  /// Compares all modules that answer to each other, and names those that do not.
  void CompareModules() {
    // Who answers to whom comes first, since everything else is measured between pairs.
    out_.matching = Match(a_, b_, out_.compared_until_us);
    PairComparer comparer(a_, b_, options_, &out_);
    // A role that only one robot plays.
    for (const Unmatched& alone : out_.matching.unmatched) {
      const std::string& module = (alone.in_a ? a_ : b_).modules[alone.module].name;
      const ItemNames names{alone.role, "", alone.in_a ? module : "", alone.in_a ? "" : module};
      Item& item = comparer.AddItem(names, Quantity::kRole, "s", 0.0);
      item.detail = fmt::format("only {} has a module {} for it", alone.in_a ? "A" : "B", module);
      // The difference is the time from when it had the role, and never 0, so that it counts as
      // one.
      const int64_t since = std::max<int64_t>(alone.taken_us, 0);
      Meter(&item).Add(since, std::max(Seconds(out_.compared_until_us - since), 1e-6));
    }
    for (const ModulePair& pair : out_.matching.pairs) comparer.Compare(pair);
    comparer.CompareRootBody();
    CompareDuration(&comparer);
  }

  /// One run may be longer than the other though they are alike as long as both last.
  void CompareDuration(PairComparer* comparer) {
    const int64_t difference = std::abs(a_.ticks_us.back() - b_.ticks_us.back());
    // The length of a cut log means nothing; that it was cut is said elsewhere.
    if (difference == 0 || a_.facts.end_state == EndState::kMissing ||
        b_.facts.end_state == EndState::kMissing || a_.facts.num_damage + b_.facts.num_damage > 0) {
      return;
    }
    const bool a_longer = a_.ticks_us.back() > b_.ticks_us.back();
    Item& item = comparer->AddItem({"(run)", "", "", ""}, Quantity::kDuration, "s", 0.0);
    item.detail = fmt::format("{} goes on after the other's end", a_longer ? "A" : "B");
    Meter(&item).Add(std::min(a_.ticks_us.back(), b_.ticks_us.back()), Seconds(difference));
  }

  /// Tells a reader what is wrong with a log, the first few places of it.
  void NoteDamage(const RunLog& log, const char* which) {
    constexpr int64_t kShown = 5;
    const LogFacts& facts = log.facts;
    const auto note = [&](const std::string& text) {
      out_.notes.push_back(fmt::format("{}: {}", which, text));
    };
    // The first places are told in full, the rest counted.
    for (const LogDamage& damage : facts.damage) {
      if (&damage - facts.damage.data() >= kShown) break;
      note(fmt::format("after {:.3f} s: {}", Seconds(damage.time_us), damage.what));
    }
    if (facts.num_damage > kShown) note(fmt::format("{} more", facts.num_damage - kShown));
    // Then which channels lack messages or are not what END lists, and what END says.
    std::string unlike;
    for (const auto& [name, channel] : facts.channels) {
      if (channel.lost > 0) {
        note(fmt::format("{} messages of {} are missing, number {} first", channel.lost, name,
                         channel.first_lost));
      }
      if (!channel.matches_end.value_or(true)) unlike += (unlike.empty() ? ": " : ", ") + name;
    }
    if (facts.end_state == EndState::kMissing) {
      note(fmt::format("no END event: the log was cut after {:.3f} s",
                       Seconds(log.ticks_us.back())));
    } else if (facts.end_state == EndState::kUnreadable) {
      note("the END event is unreadable");
    } else if (facts.end_state == EndState::kMismatch) {
      note("the content is not what the END event vouches for" + unlike);
    } else if (!facts.end->clean) {
      note("the run did not end as it should: " + facts.end->reason);
    }
  }

  /// Finds the first divergence, and from it and from what is missing the verdict.
  void Decide() {
    int64_t samples = 0;
    for (size_t i = 0; i < out_.items.size(); ++i) {
      const Item& item = out_.items[i];
      samples += item.samples;
      if (item.unit == "m") out_.max_position_m = std::max(out_.max_position_m, item.max);
      // Later divergences follow from the first one.
      if (item.unit == "rad") out_.max_rotation_rad = std::max(out_.max_rotation_rad, item.max);
      if (item.first_over_us < 0) continue;
      // Of divergences at one time the one counts that is beyond its tolerance by most.
      const auto excess = [](const Item& x) {
        return x.tolerance > 0 ? x.first_over / x.tolerance : x.first_over * 1e9;
      };
      const Item* first = out_.first ? &out_.items[*out_.first] : nullptr;
      if (first == nullptr || item.first_over_us < first->first_over_us ||
          (item.first_over_us == first->first_over_us && excess(item) > excess(*first))) {
        out_.first = i;
      }
    }
    // A difference is one, whatever is missing besides.
    if (out_.first) {
      const Item& item = out_.items[*out_.first];
      out_.verdict = Verdict::kDifferent;
      out_.reason = fmt::format("they differ from {:.3f} s on: {} of {}{}{}",
                                Seconds(item.first_over_us), QuantityName(item.quantity),
                                RoleName(item.role), item.label.empty() ? "" : ", ", item.label);
      return;
    }
    // None was found: that says something only if nothing is missing.
    out_.verdict = Verdict::kUnusable;
    if (samples == 0) {
      out_.reason = "the logs have nothing in common that could be compared";
    } else if (!Complete(a_) || !Complete(b_)) {
      out_.reason = fmt::format("no difference up to {:.3f} s, but {} damaged or incomplete",
                                Seconds(out_.compared_until_us),
                                Complete(a_)   ? "B is"
                                : Complete(b_) ? "A is"
                                               : "both are");
    } else if (!out_.not_compared.empty()) {
      out_.reason = "no difference, but not everything could be compared: " + out_.not_compared[0];
    } else {
      out_.verdict = Verdict::kEquivalent;
      out_.reason = fmt::format("no difference beyond the tolerances in {:.3f} s",
                                Seconds(out_.compared_until_us));
    }
  }

  const RunLog& a_;
  const RunLog& b_;
  const CompareOptions& options_;
  Comparison out_;
};

}  // namespace

const std::vector<QuantityGroup>& QuantityGroups() {
  using Q = Quantity;
  static const std::vector<QuantityGroup> groups = {
      {"propagated", {Q::kPropagatedPosition, Q::kPropagatedRotation, Q::kStaleness}},
      {"simulated", {Q::kSimulatedPosition, Q::kSimulatedRotation}},
      {"sensors", {Q::kJointAngle, Q::kJointTravel, Q::kJointVelocity, Q::kDocking}},
      {"commands", {Q::kCommand, Q::kSpeedLimit, Q::kConnectorCommand}}};
  return groups;
}

Comparison Compare(const RunLog& a, const RunLog& b, const CompareOptions& options) {
  return Comparer(a, b, options).Run();
}

}  // namespace morphbus::logger
