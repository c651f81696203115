#pragma once
// Which run on the bus is meant.

#include <string>

namespace morphbus {

/// A run on the bus, and how its members are reached (docs/cli.md, The parts of a run).
struct RunAddress {
  /// The run's name, with which its channels begin.
  std::string run = {};
  /// Path of a file with the run's key, 16 bytes that its owner alone may read; empty for a run
  /// without one (`--open`).
  std::string key_file = {};
  /// Where the bus is; empty: $LCM_DEFAULT_URL, else LCM's default.
  std::string lcm_url = {};
};

}  // namespace morphbus
