#pragma once
// Measures, quantity by quantity, how two modules that answer to each other differ.

#include <map>
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
  /// Both logs must have a model and at least one tick. `out` has its matching and the time until
  /// which to compare. Logs, options and `out` outlive the comparer.
  PairComparer(const RunLog& a, const RunLog& b, const CompareOptions& options, Comparison* out);

  /// Adds an item for every quantity of one pair, its links and its joints.
  void Compare(const ModulePair& pair);
  /// Adds items for where the robot frame went in the simulated world, relative to where it began;
  /// notes if a log does not hold that.
  void CompareRootBody();

  /// Adds an item without samples. The reference is valid until the next item is added.
  Item& AddItem(const ItemNames& names, Quantity quantity, const std::string& unit,
                double tolerance);
  /// False for quantities that the options leave out.
  [[nodiscard]] bool Wanted(Quantity quantity) const { return !unwanted_.contains(quantity); }

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
  /// What an item is of, in which unit it is measured, and by how much it may differ and still
  /// count as the same.
  struct Measure {
    Quantity quantity;
    const char* unit;
    double tolerance;
  };

  /// The modules of a pair, with the label of a joint or link (empty for the module as a whole).
  [[nodiscard]] Subject SubjectOf(const ModulePair& pair, const std::string& label) const;
  /// When the roles were taken, and which labels were resolved.
  void CompareRole(const Subject& modules);
  /// Rest position, propagated pose and simulated pose of a pair of links.
  void CompareLink(const Subject& of, const LinkPair& link);
  /// Angle or travel, rate and commands of a pair of joints.
  void CompareJoint(const Subject& of, const JointPair& joint);
  /// Mode, target or speed, and speed limit of the commands to a pair of joints.
  void CompareCommands(const Subject& of, const JointPair& joint);
  /// Adds an item for position and one for rotation. `simulated` tells which tolerances and
  /// quantities hold; `rest_a` and `rest_b` are the links' poses at rest, in the frame of the
  /// tracks.
  void ComparePoses(const ItemNames& names, const PoseTrack& a, const PoseTrack& b,
                    const model::Pose& rest_a, const model::Pose& rest_b, bool simulated,
                    const Lack& lack);
  /// Adds an item for two numbers over time, and lists what is lacking of them.
  void CompareScalars(const ItemNames& names, const Measure& measure, const ScalarTrack& a,
                      const ScalarTrack& b, const Lack& lack);
  /// Adds an item for counts of which none is tolerated.
  void CompareCounts(const ItemNames& names, Quantity quantity, const CountTrack& counts);
  /// Counts the ticks of either log at which the rows of times `a` and `b` are not both there.
  /// `excused(tick, in_a, in_b)` says of such a tick that nothing need be there.
  template <class Excused>
  [[nodiscard]] Lack LackAtTicks(const std::vector<int64_t>& a, const std::vector<int64_t>& b,
                                 const Excused& excused) const;
  /// The same with nothing excused.
  [[nodiscard]] Lack LackAtTicks(const std::vector<int64_t>& a,
                                 const std::vector<int64_t>& b) const;
  /// The same for propagated poses, which a module need not have before the root's can have come to
  /// it.
  [[nodiscard]] Lack LackOfPropagated(const ModulePair& pair, const PoseTrack& a,
                                      const PoseTrack& b) const;
  /// Lists in not_compared what is lacking: `what` of the module, joint or link in `names`.
  void Report(const Lack& lack, const ItemNames& names, const std::string& what);

  const RunLog& a_;
  const RunLog& b_;
  const Tolerances& tolerances_;
  Comparison& out_;
  std::set<Quantity> unwanted_;
  /// Sim times (µs) of all ticks of either log, until the end of the comparison.
  std::vector<int64_t> ticks_;
  /// The longer of the two control ticks, µs of sim time.
  int64_t tick_us_ = 0;
  /// True if the modules whose poses spread (the roots) answer to each other.
  bool same_root_ = false;
  /// X_RL of all links at rest, in A and in B.
  RestPoses rest_a_, rest_b_;
  SimulatedPoses simulated_a_, simulated_b_;
  DockingComparer dockings_;
};

}  // namespace morphbus::logger
