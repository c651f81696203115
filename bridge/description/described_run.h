#pragma once
// What a run's description says of it in single values.

#include <cstdint>
#include <string>
#include <vector>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Of a description (morphbus.proto.RunDescription); empty or 0 without one. RunModel has the rest.
struct DescribedRun {
  bool has_description = false;
  /// The run's name, with which its channels begin; no description lacks it.
  std::string run;
  std::string model_file, robot_name, program_file, mode, build, started, root_module, world_hash;
  std::string
      arithmetic;  ///< Fingerprint of the machine's (sim/arithmetic.h); empty in older logs.
  /// Of the model, which every message's header names, and of the program that the run began with.
  uint64_t model_hash = 0, program_hash = 0;
  bool still = false;  ///< Without physics (`run --still`).
  bool open = false;   ///< Without a key (`run --open`).
  /// The share of datagrams that every receiver threw away on purpose (0…1), and the seed of the
  /// random numbers which chose them.
  double loss = 0.0;
  uint64_t seed = 0;
  uint64_t random_seed = 0;  ///< Of the numbers that the program drew.
  uint64_t noise_seed = 0;   ///< Of the noise of sensors, and of what else differs by chance.
  /// The file of rules by which messages suffered on purpose (`run --faults`), and its text.
  std::string faults_file, fault_rules;
  /// What was set of the model for this run, "MTRAN.joint_1.torque=1.2" each (`run --set`).
  std::vector<std::string> attributes;
  /// Whether the root measured its pose, and the standard deviations of the noise (m, rad).
  bool root_sensor = false;
  double root_noise_m = 0, root_noise_rad = 0;
};

/// Reads them from a serialized description. Fails if the bytes are none.
Result<DescribedRun> ReadDescribedRun(const std::string& description);

}  // namespace morphbus::bridge
