#pragma once
// By how much two runs may differ and still be the same: names, defaults, and the file that sets
// them for all roles or for some (docs/log.md, "Tolerances"). SI units.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::logger {

/// Largest differences that still count as the same, in SI units. The defaults are those of a
/// comparison tick by tick; 0 demands equality.
struct Tolerances {
  /// Positions that the modules' VMs told each other: they are floats, computed from measured
  /// angles.
  double propagated_m = 1e-4;
  /// 0.01°, for the rotations that they told each other.
  double propagated_rad = 1.745e-4;
  /// Positions and, below, rotations (0.5°) in the simulated world, where contacts amplify noise.
  double simulated_m = 1e-3;
  double simulated_rad = 8.727e-3;
  /// 0.01°: joint angles are what the propagated poses are made of.
  double angle_rad = 1.745e-4;
  /// The same for prismatic joints.
  double travel_m = 1e-4;
  /// 0.5°/s, which is 0.01° in a control tick of 20 ms.
  double velocity_rad_s = 8.727e-3;
  /// The same for prismatic joints.
  double velocity_m_s = 5e-3;
  /// What motors exert (N m): about 1 % of what M-TRAN's can.
  double effort_n_m = 0.02;
  /// The same for prismatic joints (N).
  double effort_n = 0.2;
  /// 0.01°, for targets (rad), for commanded velocities and for speed limits (rad/s).
  double command_rad = 1.745e-4;
  /// The same for prismatic joints (m and m/s).
  double command_m = 1e-4;
  /// Between the times at which a role was taken; below 0 it is the longer of the two control
  /// ticks.
  double role_s = -1.0;

  // Of comparisons by event or lag.
  /// Between the times from one event of a module to its next; what happens in one run must happen
  /// in the other within so much. Five ticks: in real time a message may be three ticks old.
  double event_s = 0.1;
  /// How far the robot may have strayed: the robot frame in the world, where slipping feet sum up.
  double drift_m = 0.05;
  double drift_rad = 0.15;

  // Of the gait level, each in one cycle (gait.h).
  double cycle_s = 0.1;
  double forward_m = 0.01;
  double sideways_m = 0.01;
  double turn_rad = 0.05;
  double height_m = 0.01;
  /// A share of the cycle, 0…1.
  double duty = 0.05;
  /// 0.5°, between the largest and the smallest angle of a joint.
  double range_rad = 8.727e-3;
  double range_m = 1e-3;
  /// Shares of the larger one, since robots of all sizes are compared: of the energy of a cycle,
  /// and of the cost of transport, in which the distance has its part.
  double energy = 0.1;
  double transport = 0.15;
};

/// The defaults of comparisons by event or lag, where the runs are not the same tick for tick:
/// poses and angles are compared where the robot rests, and contacts may have gone another way.
Tolerances AlignedTolerances();

/// The tolerances by their names on the command line and in files, in the order of the structure.
const std::vector<std::pair<std::string, double Tolerances::*>>& ToleranceNames();

/// What a text says for the tolerance `name`, as people write quantities of its kind: "0.01", and
/// by the end of the name "0.5deg", "100ms" or "5%". Fails for anything else, and below 0.
Result<double> ReadTolerance(std::string_view name, std::string_view text);

/// A tolerance that was set: for all, or for some roles, joints and links.
struct ToleranceEntry {
  /// Shell patterns (fnmatch) for the role, and for the label of the joint or link; "*" for all.
  std::string role = "*";
  std::string label = "*";
  /// Which one; of ToleranceNames().
  double Tolerances::*which = nullptr;
  /// In SI units, at least 0.
  double value = 0.0;

  /// Whether it is one for this role and label.
  [[nodiscard]] bool Fits(const std::string& role_name, const std::string& label_name) const;
};

/// Reads file number `file` of `sources`, in TOML: `name = value` for all roles, the value a number
/// or a text such as "0.5deg",
/// `[role.PATTERN]` for some, `[role.PATTERN.label.PATTERN]` for some joints and links of theirs.
/// Entries come in the order of the text, so that later ones count. What is wrong is reported with
/// its place, and then the result is what could be read.
std::vector<ToleranceEntry> ParseTolerances(const source::SourceSet& sources, int file,
                                            source::Diagnostics* diagnostics);

}  // namespace morphbus::logger
