#pragma once
// Measures, quantity by quantity, how two modules that answer to each other differ.

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "logger/compare/comparer.h"
#include "logger/compare/connectors.h"
#include "logger/compare/kinematic_tracks.h"

namespace morphbus::logger {

/// Takes the differences of one item in order of time, and keeps its figures up to date. The RMS is
/// complete when the meter is destroyed, so each item has one meter at a time.
class Meter {
 public:
  /// `item` outlives the meter.
  explicit Meter(Item* item) : item_(*item) {}
  ~Meter();
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;

  /// Adds the difference (in the item's unit, at least 0) at sim time `time_us` (µs).
  void Add(int64_t time_us, double difference);

 private:
  Item& item_;
  /// Over all samples, in the square of the item's unit.
  double sum_of_squares_ = 0.0;
};

/// Whose quantity an item is: the role, the label of joint or link, and both modules. Item says
/// what empty names mean.
struct ItemNames {
  std::string role, label, module_a, module_b;
};

/// Compares pairs of modules and adds what it finds to a Comparison: items, and in `not_compared`
/// what should be there and is not. Compare() (comparer.h) makes one for a comparison.
class PairComparer {
 public:
  /// Both logs must have a model and at least one tick. `out` has its matching, its alignment, and
  /// the time until which to compare. Logs, options and `out` outlive the comparer.
  /// `own_b` is B with its own times, where `b` has A's; else it is `b`, too.
  PairComparer(const RunLog& a, const RunLog& b, const RunLog& own_b, const CompareOptions& options,
               Comparison* out);

  /// Begins with the next stretch of the runs: [begin_us, end_us) of sim time, of which both logs
  /// now hold the series. One stretch may be all. What is compared then is added to the items of
  /// the stretches before, so that each must be compared in the same steps.
  void BeginSlice(int64_t begin_us, int64_t end_us);
  /// Adds an item for every quantity of one pair, its links and its joints.
  void Compare(const ModulePair& pair);
  /// Adds items for where the robot frame went in the simulated world, relative to where it began;
  /// notes if a log does not hold that.
  void CompareRootBody();
  /// Lists what was missing, after the last stretch.
  void Finish();

  /// Adds an item without samples, or finds that of an earlier stretch. Its tolerance is the one
  /// that the options say for its quantity, role and label, and 0 if it is `exact`. The reference
  /// is valid until the next item is added.
  Item& AddItem(const ItemNames& names, Quantity quantity, const std::string& unit,
                bool exact = false);
  /// False for quantities that the options leave out.
  [[nodiscard]] bool Wanted(Quantity quantity) const;

 private:
  /// What two modules, and a joint or link of them, are compared by: their pair, their series, and
  /// the names that the items get.
  struct Subject {
    const ModulePair& pair;
    const ModuleSeries& a;
    const ModuleSeries& b;
    ItemNames names;
  };
  /// Instants at which one or both of two tracks lack a value that they should have. in_a and in_b
  /// count where A and B lack it, `instants` where any does.
  struct Lack {
    int64_t in_a = 0;
    int64_t in_b = 0;
    int64_t instants = 0;
    /// Sim time (µs) of the first such instant; -1 if there is none.
    int64_t first_us = -1;
  };
  /// Whose poses are compared: those that modules told each other, those of the simulated world, or
  /// where the whole robot went in it.
  enum class PoseKind { kPropagated, kSimulated, kDrift };
  /// What an item is of, and in which unit it is measured.
  struct Measure {
    Quantity quantity;
    const char* unit;
  };
  /// What is lacking of one thing, over all stretches.
  struct Gap {
    ItemNames names;
    std::string what;
    Lack lack;
  };

  [[nodiscard]] double ToleranceFor(const ItemNames& names, Quantity quantity,
                                    const std::string& unit) const;

  /// The modules of a pair, with the label of a joint or link (empty for the module as a whole).
  [[nodiscard]] Subject SubjectOf(const ModulePair& pair, const std::string& label) const;
  /// When the roles were taken, and which labels were resolved.
  void CompareRole(const Subject& modules);
  /// Whether and when both modules' roles were frozen, as a part of their roles' `item`.
  void CompareFreezing(const Subject& modules, Item* item);
  /// Rest position, propagated pose and simulated pose of a pair of links.
  void CompareLink(const Subject& of, const LinkPair& link);
  /// Angle or travel, rate and commands of a pair of joints.
  void CompareJoint(const Subject& of, const JointPair& joint);
  /// Mode, target or speed, and speed limit of the commands to a pair of joints.
  void CompareCommands(const Subject& of, const JointPair& joint);
  /// What stands for the former where the runs are aligned: which commands begin, and after which
  /// times.
  void CompareCommandStarts(const Subject& of, const JointPair& joint);
  /// Compares whether modules say that their poses age.
  void CompareStaleness(const Subject& modules);
  /// Where the runs are aligned: finds when both robots rest, and where the links that carry the
  /// robot frame at rest are (base_a_, base_b_).
  void FindRest();
  /// Whether neither robot moves at `time_us`, nor does within event_s before and after.
  [[nodiscard]] bool Rests(int64_t time_us) const;
  /// For each sample of a joint whether it rests there; all do where ticks are compared one by one,
  /// and where it never does.
  [[nodiscard]] std::vector<bool> RestsAt(const ScalarTrack& track, const Measure& measure) const;
  /// Poses of a link, in the frame of a base link that is at rest where `rest` says: they do not
  /// depend on which module is root, nor on where the robot strayed to.
  [[nodiscard]] static PoseTrack InBaseFrame(const PoseTrack& track, const PoseTrack& base,
                                             const model::Pose& rest);
  /// Adds an item for position and one for rotation, of the quantities that are of this kind;
  /// `rest_a` and `rest_b` are the links' poses at rest, in the frame of the tracks.
  void ComparePoses(const ItemNames& names, const PoseTrack& a, const PoseTrack& b,
                    const model::Pose& rest_a, const model::Pose& rest_b, PoseKind kind,
                    const Lack& lack);
  /// Adds an item for two numbers over time, and lists what is lacking of them.
  void CompareScalars(const ItemNames& names, const Measure& measure, const ScalarTrack& a,
                      const ScalarTrack& b, const Lack& lack);
  /// Adds an item for counts of which none is tolerated.
  void CompareCounts(const ItemNames& names, Quantity quantity, CountTrack counts);
  /// Of a count over time, what does not last for longer than event_s is left out.
  [[nodiscard]] CountTrack Lasting(CountTrack counts) const;
  /// Where the runs are aligned, what is there within event_s of an instant is not lacking.
  [[nodiscard]] bool NearlyHas(const std::vector<int64_t>& times, int64_t time_us) const;
  /// Nothing excuses what is lacking.
  static bool NeverExcused(int64_t, bool, bool) { return false; }
  /// Counts the ticks of either log at which the rows of times `a` and `b` are not both there.
  /// `excused(tick, in_a, in_b)` says of such a tick that nothing need be there.
  template <class Excused = decltype(NeverExcused)>
  [[nodiscard]] Lack LackAtTicks(const std::vector<int64_t>& a, const std::vector<int64_t>& b,
                                 const Excused& excused = NeverExcused) const;
  /// The same for propagated poses, which a module need not have before the root's can have come to
  /// it.
  [[nodiscard]] Lack LackOfPropagated(const ModulePair& pair, const PoseTrack& a,
                                      const PoseTrack& b) const;
  /// Both runs went on without these modules at that time (sim time, µs), so that neither module
  /// says anything.
  [[nodiscard]] bool BothLost(const ModulePair& pair, int64_t time_us) const;
  /// Lists in not_compared what is lacking: `what` of the module, joint or link in `names`.
  void Report(const Lack& lack, const ItemNames& names, const std::string& what);

  const RunLog& a_;
  const RunLog& b_;
  const RunLog& own_b_;
  const CompareOptions& options_;
  /// The defaults of this way of comparing.
  Tolerances tolerances_;
  Comparison& out_;
  /// True if values are compared at equal ticks, false if at rest (Alignment::by_ticks).
  bool by_ticks_ = true;
  /// The tolerance event_s, µs.
  int64_t window_us_ = 0;
  /// Sim times (µs) of all ticks of either log in this stretch, until the end of the comparison.
  std::vector<int64_t> ticks_;
  /// The first tick of either log, µs.
  int64_t first_tick_us_ = 0;
  /// The longer of the two control ticks, µs of sim time.
  int64_t tick_us_ = 0;
  /// True if the modules whose poses spread (the roots) answer to each other.
  bool same_root_ = false;
  /// The stretch, from 0; -1 before the first.
  int slice_ = -1;
  /// Of the items that later stretches find again: which comes first, and which next.
  size_t first_item_ = 0;
  size_t next_item_ = 0;
  /// By pair: how many items its roles have, which only the first stretch fills.
  std::map<const ModulePair*, size_t> role_items_;
  std::vector<Gap> gaps_;
  /// When each pair's role was taken in B, in B's own time (µs).
  std::map<const ModulePair*, int64_t> own_taken_b_;
  /// X_RL of all links at rest, in A and in B.
  const RestPoses &rest_a_, &rest_b_;
  /// Of this stretch.
  std::unique_ptr<SimulatedPoses> simulated_a_, simulated_b_;
  DockingComparer dockings_;
  /// Sim times (µs) at which the robots rest (FindRest); empty where ticks are compared one by one.
  std::vector<int64_t> at_rest_;
  /// Of the links that carry the robot frame at rest, as propagated.
  PoseTrack base_a_, base_b_;
  model::Pose rest_base_a_ = model::Pose::Identity(), rest_base_b_ = model::Pose::Identity();
};

}  // namespace morphbus::logger
