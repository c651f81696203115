#pragma once
// What two runs did with their connectors, in terms that they share: which modules are mated and
// how they then lie, and which connector states were commanded. Connectors themselves cannot be
// compared by name, since a module may be mounted the other way round.

#include <vector>

#include "logger/compare/kinematic_tracks.h"
#include "logger/compare/matcher.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// In how many ways two samples differ, at the times that both runs have.
using CountTrack = Track<int>;

/// Counts the connector commands (ACTUATOR.connectors) of a pair of modules that only one of the
/// two gave, at each tick that both have until `end_us` (sim time, µs). Connectors of B are named
/// by those of A at the same place; one without such counts as different.
CountTrack CommandDifferences(const RunLog& a, const RunLog& b, const ModulePair& pair,
                              int64_t end_us);

/// The same where the two need not act in one tick: counts, at the times of A's samples and of
/// those of B that have none, the commands that the other does not give within `window_us`.
CountTrack UnsharedCommands(const RunLog& a, const RunLog& b, const ModulePair& pair,
                            int64_t window_us, int64_t end_us);

/// Compares what connector sensors see (SENSORS.docked). A PairComparer makes one for both runs and
/// asks it for each pair of modules.
class DockingComparer {
 public:
  /// Both logs must have a model; everything outlives the comparer.
  DockingComparer(const RunLog& a, const RunLog& b, const Matching& matching);

  /// Counts the dockings of a pair of modules that only one of the two sees, at each tick that both
  /// have until `end_us` (sim time, µs): with a mate that does not answer to the other's, or that
  /// lies elsewhere by more than 1 mm or 0.6°.
  [[nodiscard]] CountTrack Differences(const ModulePair& pair, int64_t end_us) const;

 private:
  /// A docking as one module sees it.
  struct Docking {
    /// Index into Matching::pairs; -1 if the mate answers to nobody.
    int mate = -1;
    /// By what motion in the robot frame the docking puts the mate away from its place at rest;
    /// the identity for a docking that the robot declares.
    model::Pose moved = model::Pose::Identity();
  };
  /// One log with what dockings need of it: the poses of all links at rest, in the robot frame, and
  /// what module ids stand for.
  struct Side {
    const RunLog* log = nullptr;
    const RestPoses& X_RL;
    std::map<int, int> model_index_of_id;
    /// By SENSORS' module id: index into Matching::pairs; without modules that have no counterpart.
    std::map<int, int> pair_of_id;
  };

  /// What an entry of SENSORS.docked means. It is as if unknown (no mate, not moved) where the
  /// entry names a connection that the model does not have.
  [[nodiscard]] static Docking See(const Side& side, const ModuleSeries& module,
                                   const morphbus::docked_connector_t& docked);
  /// How many dockings only one of the two samples has.
  [[nodiscard]] int Unshared(const ModulePair& pair, const SensorSample& a,
                             const SensorSample& b) const;
  /// True if both lead to modules that answer to each other and put them at the same place.
  [[nodiscard]] static bool Same(const Docking& a, const Docking& b);

  Side a_, b_;
};

}  // namespace morphbus::logger
