#include "logger/comparer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace morphbus::logger {
namespace {

double Seconds(int64_t us) { return static_cast<double>(us) * 1e-6; }

/// Accumulates one item's differences in order of time.
class Meter {
 public:
  explicit Meter(Item* item) : item_(*item) {}
  ~Meter() {
    if (item_.samples > 0) item_.rms = std::sqrt(sum_ / static_cast<double>(item_.samples));
  }
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;

  void Add(int64_t time_us, double difference) {
    ++item_.samples;
    sum_ += difference * difference;
    if (difference > item_.max) {
      item_.max = difference;
      item_.max_time_us = time_us;
    }
    if (difference > item_.tolerance && item_.first_over_us < 0) {
      item_.first_over_us = time_us;
      item_.first_over = difference;
    }
  }

 private:
  Item& item_;
  double sum_ = 0.0;
};

/// One comparison in progress.
class Comparer {
 public:
  Comparer(const RunLog& a, const RunLog& b, const CompareOptions& options)
      : a_(a), b_(b), tolerances_(options.tolerances) {}

  Comparison Run();

 private:
  struct Names {
    std::string role, label, module_a, module_b;
  };

  bool Usable();
  void FindEnd();
  void CompareRoles();
  void ComparePair(const ModulePair& pair);
  void CompareRole(const ModulePair& pair);
  void CompareLink(const ModulePair& pair, const LinkPair& link);
  void CompareJoint(const ModulePair& pair, const JointPair& joint);
  void CompareCommands(const ModulePair& pair, const JointPair& joint, const Names& names);
  void ComparePoses(const Names& names, const PoseTrack& a, const PoseTrack& b,
                    const model::Pose& rest_a, const model::Pose& rest_b, bool simulated);
  void CompareDuration();
  void NoteDamage(const RunLog& log, const char* which);
  void Decide();
  Item& AddItem(const Names& names, Quantity quantity, const char* unit, double tolerance);

  const RunLog& a_;
  const RunLog& b_;
  Tolerances tolerances_;
  RestPoses rest_a_, rest_b_;
  std::unique_ptr<SimulatedPoses> simulated_a_, simulated_b_;
  Comparison out_;
};

bool Comparer::Usable() {
  for (const auto& [log, which] : {std::pair(&a_, "A"), std::pair(&b_, "B")}) {
    if (log->model == nullptr || log->robot == nullptr) {
      out_.reason =
          fmt::format("{} ({}) does not say which robot it shows: {}", which, log->facts.path,
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

Item& Comparer::AddItem(const Names& names, Quantity quantity, const char* unit, double tolerance) {
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

/// Until when both logs can be trusted and have something to say.
void Comparer::FindEnd() {
  int64_t end = std::min(a_.ticks_us.back(), b_.ticks_us.back());
  for (const RunLog* log : {&a_, &b_}) {
    for (const LogDamage& damage : log->facts.damage) end = std::min(end, damage.time_us);
  }
  out_.compared_until_us = end;
}

void Comparer::NoteDamage(const RunLog& log, const char* which) {
  constexpr int64_t kShown = 5;
  const LogFacts& facts = log.facts;
  int64_t shown = 0;
  for (const LogDamage& damage : facts.damage) {
    if (++shown > kShown) break;
    out_.notes.push_back(
        fmt::format("{}: after {:.3f} s: {}", which, Seconds(damage.time_us), damage.what));
  }
  if (facts.num_damage > kShown) {
    out_.notes.push_back(fmt::format("{}: {} more", which, facts.num_damage - kShown));
  }
  if (facts.lost() > 0) {
    for (const auto& [name, channel] : facts.channels) {
      if (channel.lost == 0) continue;
      out_.notes.push_back(fmt::format("{}: {} messages of {} are missing, number {} first", which,
                                       channel.lost, name, channel.first_lost));
    }
  }
  if (facts.end_state == EndState::kVerified) return;
  if (facts.end_state == EndState::kMissing) {
    out_.notes.push_back(fmt::format("{}: no END event: the log was cut after {:.3f} s", which,
                                     Seconds(log.ticks_us.back())));
  } else if (facts.end_state == EndState::kUnreadable) {
    out_.notes.push_back(fmt::format("{}: the END event is unreadable", which));
  } else {
    std::string channels;
    for (const auto& [name, channel] : facts.channels) {
      if (channel.matches_end.value_or(true)) continue;
      channels += (channels.empty() ? "" : ", ") + name;
    }
    out_.notes.push_back(fmt::format("{}: the content is not what the END event vouches for{}{}",
                                     which, channels.empty() ? "" : ": ", channels));
  }
}

void Comparer::CompareRole(const ModulePair& pair) {
  const double tick_s = Seconds(std::max(a_.tick_us, b_.tick_us));
  const Names names{pair.role, "", a_.modules[pair.a].name, b_.modules[pair.b].name};
  Item& item =
      AddItem(names, Quantity::kRole, "s", tolerances_.role_s < 0 ? tick_s : tolerances_.role_s);
  {
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
    if (item.first_over_us < 0 && pair.spans_a.size() != pair.spans_b.size()) {
      const auto& longer = pair.spans_a.size() > common ? pair.spans_a : pair.spans_b;
      const RoleSpan& extra = longer[common];
      item.detail = fmt::format("only {} goes on to '{}'", pair.spans_a.size() > common ? "A" : "B",
                                extra.role);
      meter.Add(extra.begin_us, Seconds(out_.compared_until_us - extra.begin_us));
    }
  }
  for (const auto& [missing, which] :
       {std::pair(&pair.labels_missing_a, "A"), std::pair(&pair.labels_missing_b, "B")}) {
    for (const std::string& label : *missing) {
      Names with_label = names;
      with_label.label = label;
      Item& lacking = AddItem(with_label, Quantity::kRole, "s", 0.0);
      lacking.detail = fmt::format("{} did not resolve the label", which);
      Meter(&lacking).Add(std::max(pair.taken_a_us, pair.taken_b_us),
                          Seconds(out_.compared_until_us));
    }
  }
}

void Comparer::ComparePoses(const Names& names, const PoseTrack& a, const PoseTrack& b,
                            const model::Pose& rest_a, const model::Pose& rest_b, bool simulated) {
  const PoseDifferences d = Differences(a, b, rest_a, rest_b, out_.compared_until_us);
  const auto measure = [&](Quantity quantity, const char* unit, double tolerance,
                           const std::vector<double>& values) {
    Item& item = AddItem(names, quantity, unit, tolerance);
    item.missing = d.missing;
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
}

void Comparer::CompareLink(const ModulePair& pair, const LinkPair& link) {
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const Names names{pair.role, link.label, ma.name, mb.name};
  const model::Pose& rest_a = rest_a_[ma.model_index][link.link_a];
  const model::Pose& rest_b = rest_b_[mb.model_index][link.link_b];
  const auto centre = [](const RunLog& log, const ModuleSeries& m, int l, const model::Pose& rest) {
    return Eigen::Vector3d(rest *
                           LinkCentre(log.model->TypeOf(*log.robot, m.model_index).links[l]));
  };
  // Either the frames or the shapes must lie at one place: frames differ between mountings of a
  // module, shapes between versions of it.
  const double apart =
      std::min((rest_a.translation() - rest_b.translation()).norm(),
               (centre(a_, ma, link.link_a, rest_a) - centre(b_, mb, link.link_b, rest_b)).norm());
  if (apart > tolerances_.propagated_m) {
    Item& item = AddItem(names, Quantity::kRestPosition, "m", tolerances_.propagated_m);
    Meter(&item).Add(0, apart);
  }
  ComparePoses(names, PropagatedTrack(ma, link.link_a), PropagatedTrack(mb, link.link_b), rest_a,
               rest_b, false);
  if (simulated_a_->available() && simulated_b_->available()) {
    ComparePoses(names, simulated_a_->LinkTrack(ma.model_index, link.link_a),
                 simulated_b_->LinkTrack(mb.model_index, link.link_b), rest_a, rest_b, true);
  }
}

void Comparer::CompareCommands(const ModulePair& pair, const JointPair& joint, const Names& names) {
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const SignTimeline signs_a(ma, joint.joint_a);
  const SignTimeline signs_b(mb, joint.joint_b);
  const CommandTrack a = CommandsOf(ma, joint.joint_a, joint.convention ? &signs_a : nullptr, 1);
  const CommandTrack b =
      CommandsOf(mb, joint.joint_b, joint.convention ? &signs_b : nullptr, joint.sign_b);
  Item& item = AddItem(names, Quantity::kCommand, joint.prismatic ? "m" : "rad",
                       joint.prismatic ? tolerances_.command_m : tolerances_.command_rad);
  Meter meter(&item);
  item.missing =
      ForCommonTimes(a.time_us, b.time_us, out_.compared_until_us, [&](size_t i, size_t j) {
        double difference = std::abs(a.value[i] - b.value[j]);
        if (a.mode[i] != b.mode[j]) {
          // A target against none is at least a visible difference.
          difference = std::max(difference, 2 * item.tolerance);
          if (item.detail.empty()) {
            item.detail = fmt::format("mode {} against {} at {:.3f} s", a.mode[i], b.mode[j],
                                      Seconds(a.time_us[i]));
          }
        }
        meter.Add(a.time_us[i], difference);
      });
}

void Comparer::CompareJoint(const ModulePair& pair, const JointPair& joint) {
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const Names names{pair.role, joint.label, ma.name, mb.name};
  const SignTimeline signs_a(ma, joint.joint_a);
  const SignTimeline signs_b(mb, joint.joint_b);
  const ScalarTrack a = AngleTrack(ma, joint.joint_a, joint.convention ? &signs_a : nullptr, 1);
  const ScalarTrack b =
      AngleTrack(mb, joint.joint_b, joint.convention ? &signs_b : nullptr, joint.sign_b);
  {
    Item& item = AddItem(names, joint.prismatic ? Quantity::kJointTravel : Quantity::kJointAngle,
                         joint.prismatic ? "m" : "rad",
                         joint.prismatic ? tolerances_.travel_m : tolerances_.angle_rad);
    Meter meter(&item);
    item.missing = ForCommonTimes(
        a.time_us, b.time_us, out_.compared_until_us,
        [&](size_t i, size_t j) { meter.Add(a.time_us[i], std::abs(a.value[i] - b.value[j])); });
  }
  CompareCommands(pair, joint, names);
}

void Comparer::ComparePair(const ModulePair& pair) {
  CompareRole(pair);
  for (const LinkPair& link : pair.links) CompareLink(pair, link);
  for (const JointPair& joint : pair.joints) CompareJoint(pair, joint);
}

void Comparer::CompareRoles() {
  out_.matching = Match(a_, b_, out_.compared_until_us);
  for (const Unmatched& alone : out_.matching.unmatched) {
    const std::string& module = (alone.in_a ? a_ : b_).modules[alone.module].name;
    Item& item = AddItem({alone.role, "", alone.in_a ? module : "", alone.in_a ? "" : module},
                         Quantity::kRole, "s", 0.0);
    item.detail = fmt::format("only {} has a module {} for it", alone.in_a ? "A" : "B", module);
    const int64_t since = std::max<int64_t>(alone.taken_us, 0);
    Meter(&item).Add(since, std::max(Seconds(out_.compared_until_us - since), 1e-6));
  }
  for (const ModulePair& pair : out_.matching.pairs) ComparePair(pair);
  if (simulated_a_->available() && simulated_b_->available()) {
    const model::Pose here = model::Pose::Identity();
    ComparePoses({"(root body)", "", a_.robot->modules[a_.robot->root_module].name,
                  b_.robot->modules[b_.robot->root_module].name},
                 simulated_a_->RootTrack(), simulated_b_->RootTrack(), here, here, true);
  } else if (simulated_a_->available() != simulated_b_->available()) {
    out_.notes.push_back(fmt::format("{} does not hold the simulated world from its start",
                                     simulated_a_->available() ? "B" : "A"));
  }
}

void Comparer::CompareDuration() {
  const int64_t difference = std::abs(a_.ticks_us.back() - b_.ticks_us.back());
  // The length of a cut log means nothing; that it was cut is said elsewhere.
  if (difference == 0 || a_.facts.end_state == EndState::kMissing ||
      b_.facts.end_state == EndState::kMissing || a_.facts.num_damage + b_.facts.num_damage > 0) {
    return;
  }
  const bool a_longer = a_.ticks_us.back() > b_.ticks_us.back();
  Item& item = AddItem({"(run)", "", "", ""}, Quantity::kDuration, "s", 0.0);
  item.detail = fmt::format("{} goes on after the other's end", a_longer ? "A" : "B");
  Meter(&item).Add(std::min(a_.ticks_us.back(), b_.ticks_us.back()), Seconds(difference));
}

void Comparer::Decide() {
  int64_t samples = 0;
  int64_t gaps = 0;
  for (size_t i = 0; i < out_.items.size(); ++i) {
    const Item& item = out_.items[i];
    samples += item.samples;
    // A pose that only one of them has yet is a matter of when roots spoke, not of lost messages.
    const bool propagated = item.quantity == Quantity::kPropagatedPosition ||
                            item.quantity == Quantity::kPropagatedRotation;
    if (!propagated) gaps += item.missing;
    if (item.unit == "m") out_.max_position_m = std::max(out_.max_position_m, item.max);
    if (item.unit == "rad") out_.max_rotation_rad = std::max(out_.max_rotation_rad, item.max);
    if (item.first_over_us < 0) continue;
    const auto excess = [](const Item& x) {
      return x.tolerance > 0 ? x.first_over / x.tolerance : x.first_over * 1e9;
    };
    const Item* first = out_.first ? &out_.items[*out_.first] : nullptr;
    if (first == nullptr || item.first_over_us < first->first_over_us ||
        (item.first_over_us == first->first_over_us && excess(item) > excess(*first))) {
      out_.first = i;
    }
  }
  if (out_.first) {
    const Item& item = out_.items[*out_.first];
    out_.verdict = Verdict::kDifferent;
    out_.reason =
        fmt::format("they differ from {:.3f} s on: {} of {}{}{}", Seconds(item.first_over_us),
                    QuantityName(item.quantity), item.role.empty() ? "(no role)" : item.role,
                    item.label.empty() ? "" : ", ", item.label);
    return;
  }
  out_.verdict = Verdict::kUnusable;
  if (samples == 0) {
    out_.reason = "the logs have nothing in common that could be compared";
  } else if (!a_.facts.whole() || !b_.facts.whole()) {
    out_.reason = fmt::format("no difference up to {:.3f} s, but {} damaged or incomplete",
                              Seconds(out_.compared_until_us),
                              a_.facts.whole()   ? "B is"
                              : b_.facts.whole() ? "A is"
                                                 : "both are");
  } else if (gaps > 0) {
    out_.reason =
        fmt::format("no difference, but at {} instants only one of the logs has a value", gaps);
  } else {
    out_.verdict = Verdict::kEquivalent;
    out_.reason = fmt::format("no difference beyond the tolerances in {:.3f} s",
                              Seconds(out_.compared_until_us));
  }
}

ComparedLog Summary(const RunLog& log) {
  const LogFacts& facts = log.facts;
  return {facts.path,     facts.run,     facts.robot,    facts.program_file,
          facts.run_hash, facts.seconds, facts.end_state};
}

Comparison Comparer::Run() {
  out_.a = Summary(a_);
  out_.b = Summary(b_);
  if (!Usable()) return std::move(out_);
  FindEnd();
  NoteDamage(a_, "A");
  NoteDamage(b_, "B");
  rest_a_ = RestPosesOf(a_);
  rest_b_ = RestPosesOf(b_);
  simulated_a_ = std::make_unique<SimulatedPoses>(a_);
  simulated_b_ = std::make_unique<SimulatedPoses>(b_);
  CompareRoles();
  CompareDuration();
  Decide();
  return std::move(out_);
}

}  // namespace

Comparison Compare(const RunLog& a, const RunLog& b, const CompareOptions& options) {
  return Comparer(a, b, options).Run();
}

}  // namespace morphbus::logger
