#include "logger/compare/comparer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>

#include "logger/compare/pair_comparer.h"
#include "logger/compare/source_trace.h"
#include "logger/log/series_reader.h"

namespace morphbus::logger {
namespace {

/// Ticks in a stretch of two logs that are read side by side: some 10 MB of each.
constexpr size_t kSliceTicks = 1000;

/// Nothing is missing, and END says that the run ended as it should.
bool Complete(const RunLog& log) { return log.facts.whole() && log.facts.end->clean; }

/// Two logs that are read side by side, a stretch ahead of who compares them.
class SliceReaders {
 public:
  SliceReaders(std::unique_ptr<SeriesReader> a, std::unique_ptr<SeriesReader> b)
      : a_(std::move(a)), b_(std::move(b)) {}

  /// Calls use(begin, end) for the stretches of sim time that end at each of `ends` (µs,
  /// ascending), each time with the logs holding that stretch. The next one is read meanwhile, each
  /// log in a thread.
  template <class Use>
  void ForSlices(const std::vector<int64_t>& ends, const Use& use) {
    std::future<void> reading_a, reading_b;
    const auto read_until = [&](int64_t end_us) {
      reading_a = std::async(std::launch::async, [this, end_us] { a_->ReadUntil(end_us); });
      reading_b = std::async(std::launch::async, [this, end_us] { b_->ReadUntil(end_us); });
    };
    int64_t begin_us = std::numeric_limits<int64_t>::min();
    // While one stretch is compared the threads read the next one.
    read_until(ends.front());
    for (size_t i = 0; i < ends.size(); ++i) {
      reading_a.get();
      reading_b.get();
      a_->Install(ends[i]);
      b_->Install(ends[i]);
      if (i + 1 < ends.size()) read_until(ends[i + 1]);
      use(begin_us, ends[i]);
      begin_us = ends[i];
    }
  }

 private:
  std::unique_ptr<SeriesReader> a_, b_;
};

/// One comparison in progress: Run() goes through its steps once, and the result is moved out.
class Comparer {
 public:
  /// Both logs have all of their series, or `readers` have them.
  Comparer(const RunLog& a, const RunLog& b, const CompareOptions& options,
           SliceReaders* readers = nullptr)
      : a_(a), own_b_(b), b_(&b), options_(options), readers_(readers) {}

  /// Takes the steps in their order. Logs that lack a model or ticks get their reason from Usable()
  /// and no items.
  Comparison Run() {
    out_.a = a_.facts;
    out_.b = b_->facts;
    out_.level = options_.level;
    out_.settings = DifferingSettings(a_.facts, b_->facts);
    out_.commands = PairCommands(a_.facts, b_->facts);
    if (!Usable()) return std::move(out_);
    FindEnd();
    NoteDamage(a_, "A");
    NoteDamage(*b_, "B");
    NoteArithmetic();
    NoteForeignProgram(a_, "A");
    NoteForeignProgram(*b_, "B");
    for (const std::string& group : options_.without) {
      // What the user left out must be seen in the result.
      out_.notes.push_back("left out of the comparison: " + group);
    }
    // Who answers to whom comes first, since everything else is measured between pairs.
    out_.matching = Match(a_, *b_, out_.compared_until_us);
    if (options_.level == Level::kGait) {
      out_.alignment.of_pair.resize(out_.matching.pairs.size());
      CompareGaits();
    } else {
      BringTogether();
      CompareModules();
    }
    const std::string commands = CommandsNote(out_.commands, CommandsByTicks(out_));
    if (!commands.empty()) out_.notes.push_back(commands);
    Decide();
    if (options_.level == Level::kSample) out_.trace = TraceDivergence(a_, own_b_, out_);
    return std::move(out_);
  }

 private:
  /// Without a model and a tick there is nothing to compare.
  bool Usable() {
    // The reason names the log: of two paths a reader would not know which one lacks something.
    for (const auto& [log, which] : {std::pair(&a_, "A"), std::pair(b_, "B")}) {
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
    int64_t end = std::min(a_.ticks_us.back(), b_->ticks_us.back());
    for (const RunLog* log : {&a_, b_}) {
      for (const LogDamage& damage : log->facts.damage) end = std::min(end, damage.time_us);
    }
    out_.compared_until_us = end;
  }

  /// Brings B's times onto A's, as the options ask.
  void BringTogether() {
    out_.alignment = FindAlignment(a_, own_b_, out_.matching, options_.align);
    if (options_.align != Align::kTick) out_.notes.push_back(AlignmentText(out_.alignment));
    if (out_.alignment.by_ticks) return;
    auto aligned =
        std::make_shared<const RunLog>(Aligned(a_, own_b_, out_.matching, out_.alignment));
    b_ = aligned.get();
    out_.aligned_b = std::move(aligned);
    // From here on all times are A's.
    FindEnd();
    for (ModulePair& pair : out_.matching.pairs) {
      pair.spans_b = RoleSpans(b_->modules[pair.b], out_.compared_until_us);
      pair.taken_b_us = FirstTaken(pair.spans_b, pair.role).value_or(pair.taken_b_us);
    }
    // Runs of which most has no counterpart are not the same, whatever the rest says.
    const int64_t begin = std::max(a_.ticks_us.front(), b_->ticks_us.front());
    const int64_t shorter = std::min(a_.ticks_us.back() - a_.ticks_us.front(),
                                     b_->ticks_us.back() - b_->ticks_us.front());
    if (2 * (out_.compared_until_us - begin) < shorter) {
      out_.not_compared.push_back(
          fmt::format("most of the runs: aligned, they have only {:.3f} s in common",
                      Seconds(std::max<int64_t>(0, out_.compared_until_us - begin))));
    }
  }

  /// A role that only one robot plays.
  void CompareCasts(PairComparer* comparer) {
    for (const Unmatched& alone : out_.matching.unmatched) {
      const std::string& module = (alone.in_a ? a_ : *b_).modules[alone.module].name;
      const ItemNames names{alone.role, "", alone.in_a ? module : "", alone.in_a ? "" : module};
      Item& item = comparer->AddItem(names, Quantity::kRole, "s", true);
      item.detail = fmt::format("only {} has a module {} for it", alone.in_a ? "A" : "B", module);
      // The difference is the time from when it had the role, and never 0, so that it counts as
      // one.
      const int64_t since = std::max<int64_t>(alone.taken_us, 0);
      Meter(&item).Add(since, std::max(Seconds(out_.compared_until_us - since), 1e-6));
    }
  }

  /// Compares all modules that answer to each other, and names those that do not.
  void CompareModules() {
    PairComparer comparer(a_, *b_, own_b_, options_, &out_);
    CompareCasts(&comparer);
    const auto compare = [&](int64_t begin_us, int64_t end_us) {
      comparer.BeginSlice(begin_us, end_us);
      for (const ModulePair& pair : out_.matching.pairs) comparer.Compare(pair);
      comparer.CompareRootBody();
    };
    if (readers_ == nullptr) {
      compare(std::numeric_limits<int64_t>::min(), std::numeric_limits<int64_t>::max());
    } else {
      readers_->ForSlices(SliceEnds(), compare);
    }
    comparer.Finish();
    if (out_.alignment.by_ticks) CompareDuration(&comparer);
  }

  /// Where stretches end: every kSliceTicks ticks of A, and behind the last instant.
  [[nodiscard]] std::vector<int64_t> SliceEnds() const {
    std::vector<int64_t> ends;
    for (size_t i = kSliceTicks; i < a_.ticks_us.size(); i += kSliceTicks) {
      if (a_.ticks_us[i] <= out_.compared_until_us) ends.push_back(a_.ticks_us[i]);
    }
    // A damaged log may tell the latest time that there is.
    constexpr int64_t kLatest = std::numeric_limits<int64_t>::max();
    ends.push_back(std::min(out_.compared_until_us, kLatest - 1) + 1);
    return ends;
  }

  /// Compares the figures of both gaits.
  void CompareGaits() {
    PairComparer comparer(a_, *b_, own_b_, options_, &out_);
    CompareCasts(&comparer);
    const RunFigures& a = out_.figures_a.emplace(FiguresOf(a_));
    const RunFigures& b = out_.figures_b.emplace(FiguresOf(*b_));
    if (a.gait && b.gait) return CompareFigures(&comparer, *a.gait, *b.gait);
    // Without a gait in either there are no figures; with one in one of them they differ.
    if (!a.gait && !b.gait) {
      out_.not_compared.push_back(
          a.why_no_gait == b.why_no_gait
              ? fmt::format("gait: neither run has a cycle, since {}", a.why_no_gait)
              : fmt::format("gait: A has no cycle, since {}, and neither has B, since {}",
                            a.why_no_gait, b.why_no_gait));
      return;
    }
    const Gait& only = a.gait ? *a.gait : *b.gait;
    Item& item = comparer.AddItem({"(gait)", "", "", ""}, Quantity::kCycle, "s");
    item.detail = fmt::format("only {} has a cycle; of {}: {}", a.gait ? "A" : "B",
                              a.gait ? "B" : "A", a.gait ? b.why_no_gait : a.why_no_gait);
    Meter(&item).Add(only.times_us.front(), std::max(only.cycle_s, 2 * item.tolerance));
  }

  /// One item a figure, its time that of the first cycle in A.
  void CompareFigures(PairComparer* comparer, const Gait& a, const Gait& b) {
    const auto add = [&](const ItemNames& names, Quantity quantity, const char* unit, double in_a,
                         double in_b) {
      Item& item = comparer->AddItem(names, quantity, unit);
      const DisplayUnit shown = DisplayUnitOf(unit);
      item.detail = fmt::format("{:.3f} against {:.3f}{}{}", in_a * shown.scale, in_b * shown.scale,
                                *shown.name == '\0' ? "" : " ", shown.name);
      Meter(&item).Add(a.times_us.front(), std::abs(in_a - in_b));
    };
    // What grows with the robot differs by a share of the larger one.
    const auto add_share = [&](Quantity quantity, double in_a, double in_b, const char* unit) {
      Item& item = comparer->AddItem({"(gait)", "", "", ""}, quantity, "share");
      item.detail = fmt::format("{:.3f} against {:.3f}{}", in_a, in_b, unit);
      const double larger = std::max(in_a, in_b);
      Meter(&item).Add(a.times_us.front(), larger > 0.0 ? std::abs(in_a - in_b) / larger : 0.0);
    };
    const ItemNames gait{"(gait)", "", "", ""};
    // The cycle and what joints do are known of every log; where the robot went and how it stood,
    // only of one that has the simulated world.
    add(gait, Quantity::kCycle, "s", a.cycle_s, b.cycle_s);
    const auto names = [&](const FigurePair& figure) {
      return ItemNames{figure.pair->role, figure.label, a_.modules[figure.pair->a].name,
                       b_->modules[figure.pair->b].name};
    };
    if (comparer->Wanted(Quantity::kJointAngle)) {
      for (const FigurePair& range : RangePairs(out_.matching, a_, *b_, a, b)) {
        add(names(range), Quantity::kRange, range.prismatic ? "m" : "rad", range.a, range.b);
      }
    }
    if (!comparer->Wanted(Quantity::kSimulatedPosition)) return;
    for (const auto& [figures, which] : {std::pair(&a, "A"), std::pair(&b, "B")}) {
      if (!figures->cycles.empty()) continue;
      out_.not_compared.push_back(
          fmt::format("where the gait leads: {} does not hold the simulated world", which));
    }
    if (a.cycles.empty() || b.cycles.empty()) return;
    add(gait, Quantity::kForward, "m", a.forward_m, b.forward_m);
    add(gait, Quantity::kSideways, "m", a.left_m, b.left_m);
    add(gait, Quantity::kTurn, "rad", a.turn_rad, b.turn_rad);
    add(gait, Quantity::kHeight, "m", a.height_m, b.height_m);
    if (comparer->Wanted(Quantity::kEnergy)) {
      add_share(Quantity::kEnergy, a.energy_j, b.energy_j, " J");
    }
    // Without a cost of one of them, the distances differ, or neither came anywhere.
    if (a.transport.cost && b.transport.cost) {
      add_share(Quantity::kTransport, *a.transport.cost, *b.transport.cost, "");
    }
    for (const FigurePair& duty : DutyPairs(out_.matching, a_, *b_, a, b)) {
      add(names(duty), Quantity::kDuty, "share", duty.a, duty.b);
    }
  }

  /// One run may be longer than the other though they are alike as long as both last.
  void CompareDuration(PairComparer* comparer) {
    const int64_t difference = std::abs(a_.ticks_us.back() - b_->ticks_us.back());
    // The length of a cut log means nothing; that it was cut is said elsewhere.
    if (difference == 0 || a_.facts.end_state == EndState::kMissing ||
        b_->facts.end_state == EndState::kMissing ||
        a_.facts.num_damage + b_->facts.num_damage > 0) {
      return;
    }
    const bool a_longer = a_.ticks_us.back() > b_->ticks_us.back();
    Item& item = comparer->AddItem({"(run)", "", "", ""}, Quantity::kDuration, "s");
    item.detail = fmt::format("{} goes on after the other's end", a_longer ? "A" : "B");
    Meter(&item).Add(std::min(a_.ticks_us.back(), b_->ticks_us.back()), Seconds(difference));
  }

  /// Tells a reader that machines or builds computed otherwise, so that no difference of the runs'
  /// inputs need be behind one of their messages. Of older logs nobody knows.
  void NoteArithmetic() {
    const std::string& a = a_.facts.arithmetic;
    const std::string& b = b_->facts.arithmetic;
    if (a.empty() || b.empty() || a == b) return;
    out_.notes.push_back(fmt::format(
        "their arithmetic differs (A {}, B {}), so that equal hashes cannot be expected", a, b));
  }

  /// Whose program nobody knows has not been compared as what the log says that it is.
  void NoteForeignProgram(const RunLog& log, const char* which) {
    const std::string& what = log.facts.foreign_program;
    if (!what.empty()) out_.not_compared.push_back(fmt::format("{}: {}", which, what));
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
    } else if (!Complete(a_) || !Complete(*b_)) {
      out_.reason = fmt::format("no difference up to {:.3f} s, but {} damaged or incomplete",
                                Seconds(out_.compared_until_us),
                                Complete(a_)    ? "B is"
                                : Complete(*b_) ? "A is"
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
  /// B with its own times, and B as it is compared.
  const RunLog& own_b_;
  const RunLog* b_;
  const CompareOptions& options_;
  SliceReaders* readers_;
  Comparison out_;
};

}  // namespace

bool CommandsByTicks(const Comparison& comparison) {
  return comparison.level == Level::kSample && comparison.alignment.by_ticks;
}

Comparison Compare(const RunLog& a, const RunLog& b, const CompareOptions& options) {
  return Comparer(a, b, options).Run();
}

Result<Comparison> CompareFiles(const std::string& path_a, const std::string& path_b,
                                const CompareOptions& options) {
  // What needs the whole of a run is compared in memory.
  const bool whole = options.level == Level::kGait || options.align != Align::kTick;
  const RunLogOptions how = {"", whole, !whole, options.description};
  std::future<Result<RunLog>> loading_b =
      std::async(std::launch::async, [&] { return LoadRunLog(path_b, how); });
  Result<RunLog> a = LoadRunLog(path_a, how);
  Result<RunLog> b = loading_b.get();
  if (!a) return tl::unexpected(a.error());
  if (!b) return tl::unexpected(b.error());
  if (whole) return Compare(*a, *b, options);
  auto reader_a = SeriesReader::Open(&*a);
  if (!reader_a) return tl::unexpected(reader_a.error());
  auto reader_b = SeriesReader::Open(&*b);
  if (!reader_b) return tl::unexpected(reader_b.error());
  SliceReaders readers(std::move(*reader_a), std::move(*reader_b));
  return Comparer(*a, *b, options, &readers).Run();
}

}  // namespace morphbus::logger
