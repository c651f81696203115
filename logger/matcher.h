#pragma once
// Which module, joint and link of one run answers to which of another: by role and label, never by
// module name. Congruent robots number and mount their modules differently.

#include <cstdint>
#include <string>
#include <vector>

#include "logger/kinematic_tracks.h"
#include "logger/run_log.h"

namespace morphbus::logger {

/// Two links that answer to each other.
struct LinkPair {
  std::string label;  ///< The role's label; empty for the module's root link.
  int link_a = 0;
  int link_b = 0;
};

/// Two joints that answer to each other.
struct JointPair {
  std::string label;  ///< The role's label, or the joint's name in A where no label names it.
  bool labelled = false;
  int joint_a = 0;
  int joint_b = 0;
  bool prismatic = false;
  bool convention = false;  ///< Both have one: compare under it. Else raw, B's times `sign_b`.
  int sign_b = 1;           ///< From how the two axes lie in the robot frame at rest.
};

/// Two modules that answer to each other.
struct ModulePair {
  std::string role;  ///< Empty: neither ever had one.
  int a = 0;         ///< Index into RunLog::modules of the first log; `b` of the second.
  int b = 0;
  std::vector<RoleSpan> spans_a;
  std::vector<RoleSpan> spans_b;
  int64_t taken_a_us = -1;  ///< When the role was first taken; -1 without one.
  int64_t taken_b_us = -1;
  double distance_m = 0.0;      ///< Between the modules' places, in the robot frame, at that time.
  std::vector<LinkPair> links;  ///< The root link first, then labels in order of name.
  std::vector<JointPair> joints;  ///< Labels in order of name, then the module's other joints.
  std::vector<std::string> labels_missing_a;  ///< Labels that only the other log resolved.
  std::vector<std::string> labels_missing_b;
};

/// A module whose role nobody plays in the other run.
struct Unmatched {
  bool in_a = true;
  int module = 0;
  std::string role;
  int64_t taken_us = 0;
};

struct Matching {
  std::vector<ModulePair> pairs;  ///< In order of role, then of module name in A.
  std::vector<Unmatched> unmatched;
};

/// Matches the modules of two logs, both of which must have a model. A module counts under the role
/// it held longest until `end_us`. Several holders of one role are paired nearest first, by their
/// places (mean of the links' centres) in the robot frame when the role was taken; for congruent
/// robots that keep the robot frame that is the congruence. A module's root link is its first in A,
/// and in B the link whose centre lies nearest at rest. Joints without a label are paired if their
/// axes coincide.
Matching Match(const RunLog& a, const RunLog& b, int64_t end_us);

}  // namespace morphbus::logger
