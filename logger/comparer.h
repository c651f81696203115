#pragma once
// Comparison of two runs by role and label, along sim time. docs/log.md defines every quantity.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "logger/kinematic_tracks.h"
#include "logger/matcher.h"
#include "logger/run_log.h"

namespace morphbus::logger {

/// Largest differences that still count as the same. SI.
struct Tolerances {
  double propagated_m = 1e-4;        ///< What VMs told each other (floats, from measured angles).
  double propagated_rad = 1.745e-4;  ///< 0.01°.
  double simulated_m = 1e-3;
  double simulated_rad = 8.727e-3;  ///< 0.5°.
  double angle_rad = 1.745e-4;      ///< 0.01°: what the propagated poses are made of.
  double travel_m = 1e-4;           ///< Prismatic joints.
  double command_rad = 1.745e-4;    ///< 0.01°; also rad/s.
  double command_m = 1e-4;          ///< Prismatic joints; also m/s.
  double role_s = -1.0;             ///< Between times of taking a role; below 0: one control tick.
};

struct CompareOptions {
  Tolerances tolerances;
};

enum class Verdict { kEquivalent, kDifferent, kUnusable };

enum class Quantity {
  kRole,                ///< s: when the role was taken, and what it resolved.
  kPropagatedPosition,  ///< m
  kPropagatedRotation,  ///< rad
  kSimulatedPosition,   ///< m
  kSimulatedRotation,   ///< rad
  kJointAngle,          ///< rad
  kJointTravel,         ///< m
  kCommand,             ///< rad, rad/s, m or m/s
  kRestPosition,        ///< m: the links do not lie at the same place at the start values.
  kDuration,            ///< s: one run is longer.
};

/// How one thing differs.
struct Item {
  Quantity quantity = Quantity::kRole;
  std::string role;   ///< "(root body)" for where the robot went, "(run)" for the run itself.
  std::string label;  ///< Of the joint or link; empty: the module's root link.
  std::string module_a;
  std::string module_b;
  std::string unit;     ///< "m", "rad", "s".
  int64_t samples = 0;  ///< Instants at which both runs have it.
  int64_t missing = 0;  ///< Instants at which only one has it.
  double max = 0.0;
  double rms = 0.0;
  double tolerance = 0.0;
  int64_t max_time_us = 0;     ///< Sim time of the largest difference.
  int64_t first_over_us = -1;  ///< First time beyond the tolerance; -1: never.
  double first_over = 0.0;     ///< The difference at that time.
  std::string detail;          ///< More, for people: "mode 1 against 0".
};

/// Which log was compared.
struct ComparedLog {
  std::string path, run, robot, program_file, run_hash;
  double seconds = 0.0;
  EndState end_state = EndState::kMissing;
};

struct Comparison {
  ComparedLog a, b;
  Verdict verdict = Verdict::kUnusable;
  std::string reason;              ///< One sentence that says why the verdict.
  std::vector<Item> items;         ///< In order of role, label, quantity.
  std::optional<size_t> first;     ///< Item of the first divergence.
  double max_position_m = 0.0;     ///< Over all quantities in metres.
  double max_rotation_rad = 0.0;   ///< Over all quantities in radians.
  int64_t compared_until_us = 0;   ///< Sim time; earlier than the logs' end if one is damaged.
  std::vector<std::string> notes;  ///< Damage, losses, lengths: what a reader must know.
  Matching matching;
};

/// Compares two logs. Never fails: what cannot be compared is kUnusable with a reason. Damaged logs
/// are compared up to the damage and are never kEquivalent. If END's hashes contradict a log's
/// content, a difference found is still kDifferent; none found is kUnusable.
Comparison Compare(const RunLog& a, const RunLog& b, const CompareOptions& options = {});

const char* VerdictName(Verdict verdict);     ///< "equivalent", "different", "unusable".
const char* QuantityName(Quantity quantity);  ///< E.g. "joint angle".

/// For a terminal: verdict, first divergence, a table by role.
std::string ComparisonText(const Comparison& comparison);
/// The object of `compare --json`; keys in docs/log.md.
nlohmann::json ComparisonJson(const Comparison& comparison);

}  // namespace morphbus::logger
