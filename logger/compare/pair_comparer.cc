#include "logger/compare/pair_comparer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bridge/description/run_model.h"
#include "compiler/base/check.h"

namespace morphbus::logger {
namespace {

/// True if the module had a role at `time_us`.
bool HasRole(const std::vector<RoleSpan>& spans, int64_t time_us) {
  return std::any_of(spans.begin(), spans.end(), [time_us](const RoleSpan& span) {
    return !span.role.empty() && span.begin_us <= time_us && time_us <= span.end_us;
  });
}

/// True if the module was the root of its run: the one whose pose spreads through the robot.
bool IsRoot(const RunLog& log, int module) {
  return !log.facts.root_module.empty() && log.modules[module].name == log.facts.root_module;
}

/// True if the run went on without the module at `time_us`.
bool IsLost(const RunLog& log, int module, int64_t time_us) {
  const auto lost = log.facts.lost_modules.find(log.modules[module].name);
  return lost != log.facts.lost_modules.end() && lost->second <= time_us;
}

/// Where the middle of a link is in the robot frame at rest (m).
Eigen::Vector3d RestCentre(const RunLog& log, const ModuleSeries& module, int link,
                           const model::Pose& rest) {
  return rest * LinkCentre(log.model->TypeOf(*log.robot, module.model_index).links[link]);
}

}  // namespace

Meter::~Meter() {
  if (item_.samples > 0) {
    item_.rms = std::sqrt(sum_of_squares_ / static_cast<double>(item_.samples));
  }
}

void Meter::Add(int64_t time_us, double difference) {
  // Largest difference, RMS, and the first time beyond the tolerance.
  ++item_.samples;
  sum_of_squares_ += difference * difference;
  if (difference > item_.max) {
    item_.max = difference;
    item_.max_time_us = time_us;
  }
  if (difference > item_.tolerance && item_.first_over_us < 0) {
    item_.first_over_us = time_us;
    item_.first_over = difference;
  }
}

PairComparer::PairComparer(const RunLog& a, const RunLog& b, const RunLog& own_b,
                           const CompareOptions& options, Comparison* out)
    : a_(a),
      b_(b),
      own_b_(own_b),
      options_(options),
      out_(*out),
      by_ticks_(out->alignment.by_ticks),
      tick_us_(std::max(a.tick_us, b.tick_us)),
      first_item_(out->items.size()),
      rest_a_(a.described->X_RL_start),
      rest_b_(b.described->X_RL_start),
      dockings_(a, b, out->matching) {
  // By what is judged, and whether one root spoke.
  if (!by_ticks_) tolerances_ = AlignedTolerances();
  window_us_ = std::llround(ToleranceFor({}, Quantity::kEvent, "s") * 1e6);
  // The first command of a role is dated from the time at which the role was taken, in B by B's own
  // clock.
  for (const ModulePair& pair : out->matching.pairs) {
    const auto spans = RoleSpans(own_b.modules[pair.b], own_b.ticks_us.back());
    own_taken_b_[&pair] = FirstTaken(spans, pair.role).value_or(-1);
  }
  first_tick_us_ = std::min(a.ticks_us.front(), b.ticks_us.front());
  same_root_ =
      std::any_of(out->matching.pairs.begin(), out->matching.pairs.end(),
                  [&](const ModulePair& pair) { return IsRoot(a, pair.a) && IsRoot(b, pair.b); });
}

void PairComparer::BeginSlice(int64_t begin_us, int64_t end_us) {
  ++slice_;
  // Items that were added before the first stretch are not compared by it.
  if (slice_ == 0) first_item_ = out_.items.size();
  next_item_ = first_item_;
  // The ticks of this stretch, in either log. Runs that are aligned may begin at unlike times.
  ticks_.clear();
  std::set_union(a_.ticks_us.begin(), a_.ticks_us.end(), b_.ticks_us.begin(), b_.ticks_us.end(),
                 std::back_inserter(ticks_));
  if (!by_ticks_) begin_us = std::max({begin_us, a_.ticks_us.front(), b_.ticks_us.front()});
  ticks_.erase(std::lower_bound(ticks_.begin(), ticks_.end(), end_us), ticks_.end());
  ticks_.erase(std::upper_bound(ticks_.begin(), ticks_.end(), out_.compared_until_us),
               ticks_.end());
  ticks_.erase(ticks_.begin(), std::lower_bound(ticks_.begin(), ticks_.end(), begin_us));
  // Both robots in the simulated world.
  simulated_a_ = std::make_unique<SimulatedPoses>(a_, simulated_a_.get());
  simulated_b_ = std::make_unique<SimulatedPoses>(b_, simulated_b_.get());
  if (!by_ticks_) FindRest();
}

double PairComparer::ToleranceFor(const ItemNames& names, Quantity quantity,
                                  const std::string& unit) const {
  double Tolerances::*which = nullptr;
  for (const UnitTolerance& known : InfoOf(quantity).tolerances) {
    if (known.unit == unit) which = known.which;
  }
  if (which == nullptr) return 0.0;
  double tolerance = tolerances_.*which;
  for (const ToleranceEntry& entry : options_.tolerances) {
    if (entry.which == which && entry.Fits(names.role, names.label)) tolerance = entry.value;
  }
  // Below 0 stands for a tick: only role_s can be that.
  return tolerance < 0 ? Seconds(tick_us_) : tolerance;
}

bool PairComparer::Wanted(Quantity quantity) const {
  const std::string group(InfoOf(quantity).group);
  return group.empty() || !options_.without.contains(group);
}

Item& PairComparer::AddItem(const ItemNames& names, Quantity quantity, const std::string& unit,
                            bool exact) {
  // Later stretches add to the items of the first one, in whose order they come.
  if (slice_ > 0) {
    MORPHBUS_CHECK(next_item_ < out_.items.size());
    Item& known = out_.items[next_item_++];
    MORPHBUS_CHECK(known.quantity == quantity && known.label == names.label);
    return known;
  }
  Item item;
  item.quantity = quantity;
  item.role = names.role;
  item.label = names.label;
  item.module_a = names.module_a;
  item.module_b = names.module_b;
  item.unit = unit;
  item.tolerance = exact ? 0.0 : ToleranceFor(names, quantity, unit);
  out_.items.push_back(std::move(item));
  return out_.items.back();
}

template <class Excused>
PairComparer::Lack PairComparer::LackAtTicks(const std::vector<int64_t>& a,
                                             const std::vector<int64_t>& b,
                                             const Excused& excused) const {
  Lack lack;
  // Where one or both lack a value, the instant counts once, and for each side that lacks it. All
  // rows are in order of time, so that one pass finds out.
  size_t i = 0;
  size_t j = 0;
  for (const int64_t tick : ticks_) {
    while (i < a.size() && a[i] < tick) ++i;
    while (j < b.size() && b[j] < tick) ++j;
    const bool in_a = (i < a.size() && a[i] == tick) || NearlyHas(a, tick);
    const bool in_b = (j < b.size() && b[j] == tick) || NearlyHas(b, tick);
    if ((in_a && in_b) || excused(tick, in_a, in_b)) continue;
    lack.in_a += in_a ? 0 : 1;
    lack.in_b += in_b ? 0 : 1;
    ++lack.instants;
    if (lack.first_us < 0) lack.first_us = tick;
  }
  return lack;
}

/// A module has poses once the root's have come to it, one module a tick, and from then on for as
/// long as it has a role. Until they can have come, only robots with one root must agree.
PairComparer::Lack PairComparer::LackOfPropagated(const ModulePair& pair, const PoseTrack& a,
                                                  const PoseTrack& b) const {
  // The root's poses reach the last module after about as many ticks as there are modules. Before
  // that, an instant counts only if one root of both runs must have reached the same modules.
  const int64_t modules = static_cast<int64_t>(std::max(a_.modules.size(), b_.modules.size()));
  const int64_t spread_us = first_tick_us_ + (modules + 1) * tick_us_;
  return LackAtTicks(a.time_us, b.time_us, [&](int64_t tick, bool in_a, bool in_b) {
    if (tick < spread_us && ((!in_a && !in_b) || !same_root_)) return true;
    if (in_a || in_b) return false;
    return BothLost(pair, tick) || (!HasRole(pair.spans_a, tick) && !HasRole(pair.spans_b, tick));
  });
}

bool PairComparer::BothLost(const ModulePair& pair, int64_t time_us) const {
  return IsLost(a_, pair.a, time_us) && IsLost(b_, pair.b, time_us);
}

void PairComparer::Report(const Lack& lack, const ItemNames& names, const std::string& what) {
  if (lack.instants == 0) return;
  // One that is lacking in several stretches is one gap.
  for (Gap& gap : gaps_) {
    if (gap.what != what || gap.names.label != names.label ||
        gap.names.module_a != names.module_a || gap.names.module_b != names.module_b) {
      continue;
    }
    gap.lack.in_a += lack.in_a;
    gap.lack.in_b += lack.in_b;
    gap.lack.instants += lack.instants;
    return;
  }
  gaps_.push_back({names, what, lack});
}

void PairComparer::Finish() {
  constexpr size_t kMost = 50;
  if (!by_ticks_ && at_rest_.empty()) {
    out_.not_compared.emplace_back("poses: the robots are never at rest at one time");
  }
  for (const Gap& gap : gaps_) {
    // The list is bounded; the item's `missing` counts everything in any case.
    if (out_.not_compared.size() >= kMost) return;
    const Lack& lack = gap.lack;
    const char* where = lack.in_a == 0 ? "B" : lack.in_b == 0 ? "A" : "A and B";
    out_.not_compared.push_back(
        fmt::format("{} of {}{}{}: {} missing in {} from {:.3f} s on", gap.what,
                    RoleName(gap.names.role), gap.names.label.empty() ? "" : ", ", gap.names.label,
                    lack.instants == 1 ? "1 instant" : fmt::format("{} instants", lack.instants),
                    where, Seconds(lack.first_us)));
  }
}

PairComparer::Subject PairComparer::SubjectOf(const ModulePair& pair,
                                              const std::string& label) const {
  const ModuleSeries& a = a_.modules[pair.a];
  const ModuleSeries& b = b_.modules[pair.b];
  return {pair, a, b, {pair.role, label, a.name, b.name}};
}

void PairComparer::ComparePoses(const ItemNames& names, const PoseTrack& a, const PoseTrack& b,
                                const model::Pose& rest_a, const model::Pose& rest_b, PoseKind kind,
                                const Lack& lack) {
  // Positions (m) and rotations (rad) are two quantities of the same instants, whose tolerances
  // depend on who told the poses.
  const Track<PoseDifference> d = Differences(a, b, rest_a, rest_b, out_.compared_until_us);
  const auto add = [&](const Measure& m, double PoseDifference::*value) {
    Item& item = AddItem(names, m.quantity, m.unit);
    item.missing += lack.instants;
    Meter meter(&item);
    for (size_t i = 0; i < d.value.size(); ++i) {
      if (by_ticks_ || Rests(d.time_us[i])) meter.Add(d.time_us[i], d.value[i].*value);
    }
  };
  // By kind: propagated, simulated, drift.
  using Q = Quantity;
  static constexpr Measure kPosition[] = {
      {Q::kPropagatedPosition, "m"}, {Q::kSimulatedPosition, "m"}, {Q::kDriftPosition, "m"}};
  static constexpr Measure kRotation[] = {
      {Q::kPropagatedRotation, "rad"}, {Q::kSimulatedRotation, "rad"}, {Q::kDriftRotation, "rad"}};
  add(kPosition[static_cast<int>(kind)], &PoseDifference::metres);
  add(kRotation[static_cast<int>(kind)], &PoseDifference::radians);
  Report(lack, names, kind == PoseKind::kPropagated ? "propagated pose" : "simulated pose");
}

void PairComparer::CompareLink(const Subject& of, const LinkPair& link) {
  const ModuleSeries& ma = of.a;
  const ModuleSeries& mb = of.b;
  const ItemNames& names = of.names;
  const model::Pose& rest_a = rest_a_[ma.model_index][link.link_a];
  // The models must agree on where the link is at rest, or all else is compared amiss.
  const model::Pose& rest_b = rest_b_[mb.model_index][link.link_b];
  // Either the frames or the shapes must lie at one place: frames differ between mountings of a
  // module, shapes between versions of it.
  const double apart = std::min(
      (rest_a.translation() - rest_b.translation()).norm(),
      (RestCentre(a_, ma, link.link_a, rest_a) - RestCentre(b_, mb, link.link_b, rest_b)).norm());
  if (apart > ToleranceFor(names, Quantity::kRestPosition, "m")) {
    Item& item = AddItem(names, Quantity::kRestPosition, "m");
    if (slice_ == 0) Meter(&item).Add(0, apart);
  }
  // What the VMs told each other; missing poses count only where both must have had them.
  if (Wanted(Quantity::kPropagatedPosition)) {
    const PoseTrack a = PropagatedTrack(ma, link.link_a);
    const PoseTrack b = PropagatedTrack(mb, link.link_b);
    const Lack lack = LackOfPropagated(of.pair, a, b);
    if (by_ticks_) {
      ComparePoses(names, a, b, rest_a, rest_b, PoseKind::kPropagated, lack);
    } else {
      ComparePoses(names, InBaseFrame(a, base_a_, rest_base_a_),
                   InBaseFrame(b, base_b_, rest_base_b_), rest_a, rest_b, PoseKind::kPropagated,
                   lack);
    }
  }
  // What the simulator saw, where both logs hold it from the start.
  if (Wanted(Quantity::kSimulatedPosition) && simulated_a_->available() &&
      simulated_b_->available()) {
    PoseTrack a = simulated_a_->LinkTrack(ma.model_index, link.link_a);
    PoseTrack b = simulated_b_->LinkTrack(mb.model_index, link.link_b);
    const Lack lack = LackAtTicks(a.time_us, b.time_us);
    // How the robot is bent must agree though it may have strayed.
    if (!by_ticks_) {
      a = InBaseFrame(a, simulated_a_->RootTrack(), model::Pose::Identity());
      b = InBaseFrame(b, simulated_b_->RootTrack(), model::Pose::Identity());
    }
    ComparePoses(names, a, b, rest_a, rest_b, PoseKind::kSimulated, lack);
  }
}

void PairComparer::CompareScalars(const ItemNames& names, const Measure& measure,
                                  const ScalarTrack& a, const ScalarTrack& b, const Lack& lack) {
  Item& item = AddItem(names, measure.quantity, measure.unit);
  item.missing += lack.instants;
  // What is missing is told apart from what differs.
  Report(lack, names, QuantityName(measure.quantity));
  // Where the runs are aligned, joints are compared where they rest: how they get there depends on
  // who began a tick before whom.
  const std::vector<bool> rests_a = RestsAt(a, measure);
  const std::vector<bool> rests_b = RestsAt(b, measure);
  Meter meter(&item);
  ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
    if (rests_a[i] && rests_b[j]) meter.Add(a.time_us[i], std::abs(a.value[i] - b.value[j]));
  });
}

void PairComparer::CompareCommands(const Subject& of, const JointPair& joint) {
  // Both sides' commands are brought under one sign first.
  const Track<JointCommand> a = CommandsOf(of.a, joint.joint_a, SignsOfA(of.a, joint));
  const Track<JointCommand> b = CommandsOf(of.b, joint.joint_b, SignsOfB(of.b, joint));
  const auto each = [&](Item* item, const auto& difference) {
    Meter meter(item);
    ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
      meter.Add(a.time_us[i], difference(a.value[i], b.value[j], a.time_us[i]));
    });
  };
  // Of a target against none nothing more need be said than that, which follows below.
  each(&AddItem(of.names, Quantity::kSpeedLimit, joint.prismatic ? "m/s" : "rad/s"),
       [](const JointCommand& x, const JointCommand& y, int64_t) {
         return x.mode == y.mode ? std::abs(x.speed_limit - y.speed_limit) : 0.0;
       });
  // The target or speed itself.
  const Lack lack = LackAtTicks(a.time_us, b.time_us, [&](int64_t tick, bool in_a, bool in_b) {
    return !in_a && !in_b && BothLost(of.pair, tick);
  });
  Item& item = AddItem(of.names, Quantity::kCommand, joint.prismatic ? "m" : "rad");
  item.missing += lack.instants;
  Report(lack, of.names, QuantityName(Quantity::kCommand));
  each(&item, [&](const JointCommand& x, const JointCommand& y, int64_t time_us) {
    const double difference = std::abs(x.value - y.value);
    if (x.mode == y.mode) return difference;
    if (item.detail.empty()) {
      item.detail = fmt::format("mode {} against {} at {:.3f} s", x.mode, y.mode, Seconds(time_us));
    }
    // A target against none is at least a visible difference.
    return std::max({difference, 2 * item.tolerance, 1e-6});
  });
}

void PairComparer::CompareJoint(const Subject& of, const JointPair& joint) {
  // Measured values and their rates, at every tick of either log.
  if (Wanted(Quantity::kJointAngle)) {
    const JointSigns signs_a = SignsOfA(of.a, joint);
    const JointSigns signs_b = SignsOfB(of.b, joint);
    // Both sides' values count in one direction, whichever way round the joints are built in.
    const auto compare = [&](const Measure& measure, const auto& track) {
      const ScalarTrack a = track(of.a, joint.joint_a, signs_a);
      const ScalarTrack b = track(of.b, joint.joint_b, signs_b);
      CompareScalars(of.names, measure, a, b, LackAtTicks(a.time_us, b.time_us));
    };
    compare(joint.prismatic ? Measure{Quantity::kJointTravel, "m"}
                            : Measure{Quantity::kJointAngle, "rad"},
            AngleTrack);
    // How fast a joint moves, and what its motor exerts, says something at equal instants only.
    if (by_ticks_) {
      compare(joint.prismatic ? Measure{Quantity::kJointVelocity, "m/s"}
                              : Measure{Quantity::kJointVelocity, "rad/s"},
              VelocityTrack);
      compare(joint.prismatic ? Measure{Quantity::kJointEffort, "N"}
                              : Measure{Quantity::kJointEffort, "N m"},
              EffortTrack);
    }
  }
  if (!Wanted(Quantity::kCommand)) return;
  if (by_ticks_) {
    CompareCommands(of, joint);
  } else {
    CompareCommandStarts(of, joint);
  }
}

void PairComparer::CompareCounts(const ItemNames& names, Quantity quantity, CountTrack counts) {
  Item& item = AddItem(names, quantity, "");
  // A count is there for the instants of which both logs have a sample, so that one row of times
  // stands for both.
  item.missing += LackAtTicks(counts.time_us, counts.time_us).instants;
  if (!by_ticks_) counts = Lasting(std::move(counts));
  Meter meter(&item);
  for (size_t i = 0; i < counts.value.size(); ++i) meter.Add(counts.time_us[i], counts.value[i]);
}

void PairComparer::Compare(const ModulePair& pair) {
  const Subject modules = SubjectOf(pair, "");
  const ItemNames& names = modules.names;
  const int64_t end_us = out_.compared_until_us;
  // Role and labels, then every link and joint, then the module as a whole.
  // A role is compared over the whole run at once; in later stretches its items are only stepped
  // over.
  if (slice_ == 0) {
    const size_t before = out_.items.size();
    CompareRole(modules);
    role_items_[&pair] = out_.items.size() - before;
  } else {
    next_item_ += role_items_[&pair];
  }
  for (const LinkPair& link : pair.links) CompareLink(SubjectOf(pair, link.label), link);
  for (const JointPair& joint : pair.joints) CompareJoint(SubjectOf(pair, joint.label), joint);
  // Which modules are mated, and what connectors were told.
  if (Wanted(Quantity::kDocking)) {
    CompareCounts(names, Quantity::kDocking, dockings_.Differences(pair, end_us));
  }
  if (Wanted(Quantity::kConnectorCommand)) {
    CompareCounts(names, Quantity::kConnectorCommand,
                  by_ticks_ ? CommandDifferences(a_, b_, pair, end_us)
                            : UnsharedCommands(a_, b_, pair, window_us_, end_us));
  }
  // Staleness is compared where both had poses; that poses are there was checked with the links.
  if (Wanted(Quantity::kStaleness)) {
    CompareStaleness(modules);
  }
  // What has no counterpart in B cannot be compared, and must not pass in silence.
  if (slice_ > 0) return;
  for (const std::string& what : pair.unpaired) {
    out_.not_compared.push_back(
        fmt::format("{} of {}: B has nothing that answers to it", what, RoleName(pair.role)));
  }
}

void PairComparer::CompareRootBody() {
  // A log without the simulated world is a gap in the comparison, unless the user left it out.
  if (!Wanted(Quantity::kSimulatedPosition)) return;
  for (const auto& [simulated, which] :
       {std::pair(simulated_a_.get(), "A"), std::pair(simulated_b_.get(), "B")}) {
    if (simulated->available() || slice_ > 0) continue;
    out_.not_compared.push_back(
        fmt::format("simulated poses: {} does not hold the simulated world from its start", which));
  }
  if (!simulated_a_->available() || !simulated_b_->available()) return;
  // The items are named after the modules whose links carry the robot frame.
  const ItemNames names{"(root body)", "", a_.robot->modules[a_.robot->root_module].name,
                        b_.robot->modules[b_.robot->root_module].name};
  const model::Pose here = model::Pose::Identity();
  // The robot frame itself: its motion is compared as it is, from where it was at first.
  const PoseTrack a = simulated_a_->RootTrack();
  const PoseTrack b = simulated_b_->RootTrack();
  ComparePoses(names, a, b, here, here, by_ticks_ ? PoseKind::kSimulated : PoseKind::kDrift,
               LackAtTicks(a.time_us, b.time_us));
}

}  // namespace morphbus::logger
