#pragma once
// Which module, joint and link of one run answers to which of another: by role and label, never by
// module name. Congruent robots number and mount their modules differently.

#include <cstdint>
#include <string>
#include <vector>

#include "logger/compare/kinematic_tracks.h"
#include "logger/log/run_log.h"

namespace morphbus::logger {

/// Two links that answer to each other. Link indices are in declaration order of the module's type.
struct LinkPair {
  /// The role's label, or the link's name in A where no label names it; empty for the root link.
  std::string label;
  /// True if the pair comes from a label that both runs resolved.
  bool labelled = false;
  int link_a = 0;
  int link_b = 0;
};

/// Two joints that answer to each other. Joint indices are in declaration order of the module's
/// type.
struct JointPair {
  /// The role's label, or the joint's name in A where no label names it.
  std::string label;
  /// True if the pair comes from a label that both runs resolved.
  bool labelled = false;
  int joint_a = 0;
  int joint_b = 0;
  /// True for a sliding joint, whose values are in metres.
  bool prismatic = false;
  /// True if both have a kinematic convention: their values are compared under it. Else they are
  /// compared raw, B's times `sign_b`.
  bool convention = false;
  /// +1 or -1, from how the two axes lie in the robot frame at rest.
  int sign_b = 1;
};

/// Two modules that answer to each other, and what of them does.
struct ModulePair {
  /// The role by which they were matched; empty if neither ever had one.
  std::string role;
  /// Index into RunLog::modules of the first log; `b` is one of the second.
  int a = 0;
  int b = 0;
  /// Which roles and labels each of them had, in order of time.
  std::vector<RoleSpan> spans_a;
  std::vector<RoleSpan> spans_b;
  /// Sim time (µs) at which the role was first taken in A, and in B; -1 without a role.
  int64_t taken_a_us = -1;
  int64_t taken_b_us = -1;
  /// Distance of the modules' places in the robot frame when each took the role, metres.
  double distance_m = 0.0;
  /// The root link, then labels in order of name, then others in A's order.
  std::vector<LinkPair> links;
  /// Labels in order of name, then the module's other joints in A's order.
  std::vector<JointPair> joints;
  /// By connector of B: A's connector at the same place at rest; -1 if none is there.
  std::vector<int> connector_a_of_b;
  /// Joints and links of A without a counterpart in B: "joint 'spin'".
  std::vector<std::string> unpaired;
  /// Labels that only the other log resolved.
  std::vector<std::string> labels_missing_a;
  std::vector<std::string> labels_missing_b;
};

/// A module whose role nobody plays in the other run, or of whose role the other run has fewer.
struct Unmatched {
  /// Which log's module it is, and its index into RunLog::modules there.
  bool in_a = true;
  int module = 0;
  std::string role;
  /// Sim time (µs) at which it took the role; -1 without one.
  int64_t taken_us = 0;
};

/// Who answers to whom, for a whole run.
struct Matching {
  /// In order of role, then in the order of RunLog::modules in A.
  std::vector<ModulePair> pairs;
  std::vector<Unmatched> unmatched;
};

/// Matches the modules of two logs, both of which must have a model. A module counts under the role
/// it held longest until `end_us` (sim time, µs). Several holders of one role are paired nearest
/// first, by their places (mean of the links' centres) in the robot frame when the role was taken;
/// for congruent robots that keep the robot frame that is the congruence. A module's root link is
/// its first in A, and in B the link whose centre lies nearest at rest. Joints without a label are
/// paired if their axes coincide, links and connectors if they lie at the same place (to 1 mm).
/// Modules that the model lacks are left out.
Matching Match(const RunLog& a, const RunLog& b, int64_t end_us);

/// By what the values of a joint of A are multiplied to be comparable: its convention, or 1.
JointSigns SignsOfA(const ModuleSeries& module_a, const JointPair& joint);
/// The same for its counterpart in B: its convention, or the sign of how the axes lie.
JointSigns SignsOfB(const ModuleSeries& module_b, const JointPair& joint);

}  // namespace morphbus::logger
