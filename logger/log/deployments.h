#pragma once
// Programs that people deployed while a run went on: when all modules were to go over to each, and
// when each module did.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "logger/log/tilt_track.h"

namespace morphbus::bridge {
struct ControlCommand;
}

namespace morphbus::logger {

/// One `deploy` of the run, or one `set`.
struct DeploymentFact {
  /// The tick at which CLOCK named the command.
  int64_t tick = 0;
  /// Path of the program as it was given; empty for a `set`.
  std::string program;
  /// Of a `set`: the parameter and its value, as they were given.
  std::string parameter, value;
  /// The hash of the image that modules went over to.
  uint64_t program_hash = 0;
  /// The module that got it; empty: the root.
  std::string to;
  /// The tick of the root's clock at which all were to go over to it; -1 if the command names none.
  int64_t switch_tick = -1;
  /// The first tick that each module computed under it; nothing for those that never did, before
  /// the same program was deployed again.
  std::map<std::string, std::optional<int64_t>> switched;
  /// The largest tilt of the trunk (TiltTrack, rad) in the kTiltSeconds of sim time from the tick
  /// on in which the first module went over; none if none did, or nobody knows where the trunk was.
  std::optional<double> max_tilt_rad;
};

/// How long after a deployment it counts how the robot stands, seconds of sim time.
constexpr double kTiltSeconds = 5.0;

/// Follows which program each module runs, message by message.
class ProgramChanges {
 public:
  /// A module's message of a tick, always of the same topic, with the hash of the program in its
  /// header. Those of earlier ticks than one taken before tell nothing new.
  void Take(std::string_view module, int64_t tick, uint64_t program_hash);
  /// A deployment that CLOCK of a tick names.
  void TakeDeployment(int64_t tick, const bridge::ControlCommand& command);
  /// The deployments, in order of their ticks. `tick_us` is the length of a tick, by which their
  /// times become ticks.
  [[nodiscard]] std::vector<DeploymentFact> Deployments(int32_t tick_us) const;
  /// The first program that a module named which is neither `own`, the one that the run began with,
  /// nor one of `deployments` (in its tick or later): a sentence with the module and the tick.
  /// Empty if there is none.
  [[nodiscard]] std::string WhoseIsForeign(uint64_t own,
                                           const std::vector<DeploymentFact>& deployments) const;

 private:
  /// What one module ran, from which tick on.
  struct Change {
    int64_t tick = 0;
    uint64_t program_hash = 0;
  };
  /// A module, and its newest tick.
  struct Module {
    int64_t tick = -1;
    std::vector<Change> changes;
  };
  std::map<std::string, Module, std::less<>> modules_;
  /// A deployment, and the sim time that it names, seconds.
  struct Deployment {
    DeploymentFact fact;
    std::optional<double> at;
  };
  std::multimap<int64_t, Deployment> deployments_;  ///< By the tick of CLOCK.
};

/// Completes deployments by how far the robot was tilted after each.
void AddTilts(const TiltTrack& tilts, int32_t tick_us, std::vector<DeploymentFact>* deployments);

/// A paragraph for `info`: a line a deployment. Empty without any.
std::string DeploymentsText(const std::vector<DeploymentFact>& deployments, int32_t tick_us);

}  // namespace morphbus::logger
