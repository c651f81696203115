#include "logger/compare/pair_comparer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

PairComparer::PairComparer(const RunLog& a, const RunLog& b, const CompareOptions& options,
                           Comparison* out)
    : a_(a),
      b_(b),
      tolerances_(options.tolerances),
      out_(*out),
      tick_us_(std::max(a.tick_us, b.tick_us)),
      rest_a_(RestPosesOf(a)),
      rest_b_(RestPosesOf(b)),
      simulated_a_(a),
      simulated_b_(b),
      dockings_(a, b, out->matching) {
  // What the options leave out, the instants to compare, and whether one root spoke.
  for (const QuantityGroup& group : QuantityGroups()) {
    if (!options.without.contains(group.name)) continue;
    unwanted_.insert(group.quantities.begin(), group.quantities.end());
  }
  std::set_union(a.ticks_us.begin(), a.ticks_us.end(), b.ticks_us.begin(), b.ticks_us.end(),
                 std::back_inserter(ticks_));
  ticks_.erase(std::upper_bound(ticks_.begin(), ticks_.end(), out->compared_until_us),
               ticks_.end());
  same_root_ =
      std::any_of(out->matching.pairs.begin(), out->matching.pairs.end(),
                  [&](const ModulePair& pair) { return IsRoot(a, pair.a) && IsRoot(b, pair.b); });
}

Item& PairComparer::AddItem(const ItemNames& names, Quantity quantity, const std::string& unit,
                            double tolerance) {
  Item item;
  item.quantity = quantity;
  item.role = names.role;
  item.label = names.label;
  item.module_a = names.module_a;
  item.module_b = names.module_b;
  item.unit = unit;
  item.tolerance = tolerance;
  out_.items.push_back(std::move(item));
  return out_.items.back();
}

/// At which ticks the rows of times `a` and `b` are not both there.
PairComparer::Lack PairComparer::LackAtTicks(const std::vector<int64_t>& a,
                                             const std::vector<int64_t>& b) const {
  Lack lack;
  // Where one or both lack a value, the instant counts once, and for each side that lacks it.
  for (const int64_t tick : ticks_) {
    const bool in_a = std::binary_search(a.begin(), a.end(), tick);
    const bool in_b = std::binary_search(b.begin(), b.end(), tick);
    if (in_a && in_b) continue;
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
  const int64_t spread_us = ticks_.front() + (modules + 1) * tick_us_;
  Lack lack;
  for (const int64_t tick : ticks_) {
    const bool in_a = std::binary_search(a.time_us.begin(), a.time_us.end(), tick);
    const bool in_b = std::binary_search(b.time_us.begin(), b.time_us.end(), tick);
    if (in_a && in_b) continue;
    if (tick < spread_us && ((!in_a && !in_b) || !same_root_)) continue;
    if (!in_a && !in_b && !HasRole(pair.spans_a, tick) && !HasRole(pair.spans_b, tick)) continue;
    lack.in_a += in_a ? 0 : 1;
    lack.in_b += in_b ? 0 : 1;
    ++lack.instants;
    if (lack.first_us < 0) lack.first_us = tick;
  }
  return lack;
}

void PairComparer::Report(const Lack& lack, const ItemNames& names, const std::string& what) {
  constexpr size_t kMost = 50;
  // The list is bounded; the item's `missing` counts everything in any case.
  if (lack.instants == 0 || out_.not_compared.size() >= kMost) return;
  const char* where = lack.in_a == 0 ? "B" : lack.in_b == 0 ? "A" : "A and B";
  out_.not_compared.push_back(fmt::format(
      "{} of {}{}{}: {} missing in {} from {:.3f} s on", what,
      names.role.empty() ? "(no role)" : names.role, names.label.empty() ? "" : ", ", names.label,
      lack.instants == 1 ? "1 instant" : fmt::format("{} instants", lack.instants), where,
      Seconds(lack.first_us)));
}

void PairComparer::CompareRole(const ModulePair& pair) {
  const ItemNames names{pair.role, "", a_.modules[pair.a].name, b_.modules[pair.b].name};
  Item& item = AddItem(names, Quantity::kRole, "s",
                       tolerances_.role_s < 0 ? Seconds(tick_us_) : tolerances_.role_s);
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
      meter.Add(begin, Seconds(std::abs(a.begin_us - b.begin_us)));
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
  // A label that only one of them resolved.
  for (const auto& [missing, which] :
       {std::pair(&pair.labels_missing_a, "A"), std::pair(&pair.labels_missing_b, "B")}) {
    for (const std::string& label : *missing) {
      ItemNames with_label = names;
      with_label.label = label;
      Item& lacking = AddItem(with_label, Quantity::kRole, "s", 0.0);
      lacking.detail = fmt::format("{} did not resolve the label", which);
      Meter(&lacking).Add(std::max(pair.taken_a_us, pair.taken_b_us),
                          Seconds(out_.compared_until_us));
    }
  }
}

void PairComparer::ComparePoses(const ItemNames& names, const PoseTrack& a, const PoseTrack& b,
                                const model::Pose& rest_a, const model::Pose& rest_b,
                                bool simulated, const Lack& lack) {
  // Positions (m) and rotations (rad) are two quantities of the same instants, whose tolerances
  // depend on who told the poses.
  const PoseDifferences d = Differences(a, b, rest_a, rest_b, out_.compared_until_us);
  const auto measure = [&](Quantity quantity, const char* unit, double tolerance,
                           const std::vector<double>& values) {
    Item& item = AddItem(names, quantity, unit, tolerance);
    item.missing = lack.instants;
    Meter meter(&item);
    for (size_t i = 0; i < values.size(); ++i) meter.Add(d.time_us[i], values[i]);
  };
  if (simulated) {
    measure(Quantity::kSimulatedPosition, "m", tolerances_.simulated_m, d.metres);
    measure(Quantity::kSimulatedRotation, "rad", tolerances_.simulated_rad, d.radians);
  } else {
    measure(Quantity::kPropagatedPosition, "m", tolerances_.propagated_m, d.metres);
    measure(Quantity::kPropagatedRotation, "rad", tolerances_.propagated_rad, d.radians);
  }
  Report(lack, names, simulated ? "simulated pose" : "propagated pose");
}

void PairComparer::CompareLink(const ModulePair& pair, const LinkPair& link) {
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const ItemNames names{pair.role, link.label, ma.name, mb.name};
  const model::Pose& rest_a = rest_a_[ma.model_index][link.link_a];
  // The models must agree on where the link is at rest, or all else is compared amiss.
  const model::Pose& rest_b = rest_b_[mb.model_index][link.link_b];
  // Either the frames or the shapes must lie at one place: frames differ between mountings of a
  // module, shapes between versions of it.
  const double apart = std::min(
      (rest_a.translation() - rest_b.translation()).norm(),
      (RestCentre(a_, ma, link.link_a, rest_a) - RestCentre(b_, mb, link.link_b, rest_b)).norm());
  if (apart > tolerances_.propagated_m) {
    Item& item = AddItem(names, Quantity::kRestPosition, "m", tolerances_.propagated_m);
    Meter(&item).Add(0, apart);
  }
  // What the VMs told each other; missing poses count only where both must have had them.
  if (Wanted(Quantity::kPropagatedPosition)) {
    const PoseTrack a = PropagatedTrack(ma, link.link_a);
    const PoseTrack b = PropagatedTrack(mb, link.link_b);
    ComparePoses(names, a, b, rest_a, rest_b, false, LackOfPropagated(pair, a, b));
  }
  // What the simulator saw, where both logs hold it from the start.
  if (Wanted(Quantity::kSimulatedPosition) && simulated_a_.available() &&
      simulated_b_.available()) {
    const PoseTrack a = simulated_a_.LinkTrack(ma.model_index, link.link_a);
    const PoseTrack b = simulated_b_.LinkTrack(mb.model_index, link.link_b);
    ComparePoses(names, a, b, rest_a, rest_b, true, LackAtTicks(a.time_us, b.time_us));
  }
}

void PairComparer::CompareScalars(const ItemNames& names, Quantity quantity,
                                  const std::string& unit, double tolerance, const ScalarTrack& a,
                                  const ScalarTrack& b, const Lack& lack) {
  Item& item = AddItem(names, quantity, unit, tolerance);
  item.missing = lack.instants;
  // What is missing is told apart from what differs.
  Report(lack, names, QuantityName(quantity));
  Meter meter(&item);
  ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
    meter.Add(a.time_us[i], std::abs(a.value[i] - b.value[j]));
  });
}

void PairComparer::CompareCommands(const ModulePair& pair, const JointPair& joint,
                                   const ItemNames& names) {
  // Both sides' commands are brought under one sign first.
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const CommandTrack a = CommandsOf(ma, joint.joint_a, SignsOfA(ma, joint));
  const CommandTrack b = CommandsOf(mb, joint.joint_b, SignsOfB(mb, joint));
  const double tolerance = joint.prismatic ? tolerances_.command_m : tolerances_.command_rad;
  const Lack lack = LackAtTicks(a.time_us, b.time_us);
  // The speed limits of targets; the target or speed itself follows below.
  {
    Item& item =
        AddItem(names, Quantity::kSpeedLimit, joint.prismatic ? "m/s" : "rad/s", tolerance);
    Meter meter(&item);
    ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
      // Of a target against none nothing more need be said.
      const bool comparable = a.mode[i] == b.mode[j];
      meter.Add(a.time_us[i], comparable ? std::abs(a.speed_limit[i] - b.speed_limit[j]) : 0.0);
    });
  }
  Item& item = AddItem(names, Quantity::kCommand, joint.prismatic ? "m" : "rad", tolerance);
  item.missing = lack.instants;
  Report(lack, names, QuantityName(Quantity::kCommand));
  Meter meter(&item);
  ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
    double difference = std::abs(a.value[i] - b.value[j]);
    if (a.mode[i] != b.mode[j]) {
      // A target against none is at least a visible difference.
      difference = std::max({difference, 2 * item.tolerance, 1e-6});
      if (item.detail.empty()) {
        item.detail = fmt::format("mode {} against {} at {:.3f} s", a.mode[i], b.mode[j],
                                  Seconds(a.time_us[i]));
      }
    }
    meter.Add(a.time_us[i], difference);
  });
}

void PairComparer::CompareJoint(const ModulePair& pair, const JointPair& joint) {
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const ItemNames names{pair.role, joint.label, ma.name, mb.name};
  // Measured values and their rates, at every tick of either log.
  if (Wanted(Quantity::kJointAngle)) {
    const JointSigns signs_a = SignsOfA(ma, joint);
    const JointSigns signs_b = SignsOfB(mb, joint);
    const ScalarTrack a = AngleTrack(ma, joint.joint_a, signs_a);
    const ScalarTrack b = AngleTrack(mb, joint.joint_b, signs_b);
    const bool travel = joint.prismatic;
    CompareScalars(names, travel ? Quantity::kJointTravel : Quantity::kJointAngle,
                   travel ? "m" : "rad", travel ? tolerances_.travel_m : tolerances_.angle_rad, a,
                   b, LackAtTicks(a.time_us, b.time_us));
    const ScalarTrack rate_a = VelocityTrack(ma, joint.joint_a, signs_a);
    const ScalarTrack rate_b = VelocityTrack(mb, joint.joint_b, signs_b);
    CompareScalars(names, Quantity::kJointVelocity, travel ? "m/s" : "rad/s",
                   travel ? tolerances_.velocity_m_s : tolerances_.velocity_rad_s, rate_a, rate_b,
                   LackAtTicks(rate_a.time_us, rate_b.time_us));
  }
  if (Wanted(Quantity::kCommand)) CompareCommands(pair, joint, names);
}

void PairComparer::CompareCounts(const ItemNames& names, Quantity quantity,
                                 const CountTrack& counts) {
  Item& item = AddItem(names, quantity, "", 0.0);
  const Lack lack = LackAtTicks(counts.time_us, counts.time_us);
  item.missing = lack.instants;
  Meter meter(&item);
  for (size_t i = 0; i < counts.count.size(); ++i) meter.Add(counts.time_us[i], counts.count[i]);
}

void PairComparer::CompareConnectors(const ModulePair& pair, const ItemNames& names) {
  // Which modules are mated, and what connectors were told.
  if (Wanted(Quantity::kDocking)) {
    CompareCounts(names, Quantity::kDocking, dockings_.Differences(pair, out_.compared_until_us));
  }
  if (Wanted(Quantity::kConnectorCommand)) {
    CompareCounts(names, Quantity::kConnectorCommand,
                  CommandDifferences(a_, b_, pair, out_.compared_until_us));
  }
}

void PairComparer::Compare(const ModulePair& pair) {
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const ItemNames names{pair.role, "", ma.name, mb.name};
  // Role and labels, then every link and joint, then the module as a whole.
  CompareRole(pair);
  for (const LinkPair& link : pair.links) CompareLink(pair, link);
  for (const JointPair& joint : pair.joints) CompareJoint(pair, joint);
  CompareConnectors(pair, names);
  // Staleness is compared where both had poses; that poses are there was checked with the links.
  if (Wanted(Quantity::kStaleness)) {
    CompareScalars(names, Quantity::kStaleness, "", 0.0, StalenessTrack(ma), StalenessTrack(mb),
                   {});
  }
  // What has no counterpart in B cannot be compared, and must not pass in silence.
  for (const std::string& what : pair.unpaired) {
    out_.not_compared.push_back(fmt::format("{} of {}: B has nothing that answers to it", what,
                                            pair.role.empty() ? "(no role)" : pair.role));
  }
}

void PairComparer::CompareRootBody() {
  // A log without the simulated world is a gap in the comparison, unless the user left it out.
  if (!Wanted(Quantity::kSimulatedPosition)) return;
  for (const auto& [simulated, which] :
       {std::pair(&simulated_a_, "A"), std::pair(&simulated_b_, "B")}) {
    if (simulated->available()) continue;
    out_.not_compared.push_back(
        fmt::format("simulated poses: {} does not hold the simulated world from its start", which));
  }
  if (!simulated_a_.available() || !simulated_b_.available()) return;
  // The items are named after the modules whose links carry the robot frame.
  const ItemNames names{"(root body)", "", a_.robot->modules[a_.robot->root_module].name,
                        b_.robot->modules[b_.robot->root_module].name};
  const model::Pose here = model::Pose::Identity();
  // The robot frame itself: its motion is compared as it is, from where it was at first.
  const PoseTrack a = simulated_a_.RootTrack();
  const PoseTrack b = simulated_b_.RootTrack();
  ComparePoses(names, a, b, here, here, true, LackAtTicks(a.time_us, b.time_us));
}

}  // namespace morphbus::logger
