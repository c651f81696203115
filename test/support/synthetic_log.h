#pragma once
// Logs of runs that never were: two small congruent robots and a scripted walk, for tests that must
// know exactly what two logs have in common.
//
// The module type "Seg" has two links (base at -x, arm at +x), a joint "bend" that turns the arm
// about z through the middle, and connectors c0 (base end) and c1 (arm end). Robot "one" is
// m1-m2-m3, all mounted alike. Robot "two" is the same chain under other names, k3-k1-k2: the
// middle module mounted back to front, the last one turned over. Roles: Root, Middle, Tip; labels:
// joint "bend", link "near" and "far" (towards and away from the root).

#include <cstdint>
#include <functional>
#include <morphbus/actuator_t.hpp>
#include <morphbus/sensors_t.hpp>
#include <morphbus/status_t.hpp>
#include <morphbus/transform_t.hpp>
#include <morphbus/world_t.hpp>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::test {

/// See file comment.
model::Model SyntheticModel();

struct SyntheticOptions {
  std::string robot = "one";  ///< "one" or "two".
  std::string run = "synth";
  int ticks = 100;                           ///< Of 20 ms.
  int64_t start_us = 1'700'000'000'000'000;  ///< Wall clock of the first event.
  bool end = true;                           ///< False: as if the logger had been killed.
  bool stale_end = false;  ///< END vouches for the messages as they were before the hooks.
  bool description = true;
  int role_tick = 5;  ///< When the modules take their roles.
  std::string tip_role = "Tip";
  /// Called on every message before it is encoded, so that a test can alter it.
  std::function<void(sensors_t*)> on_sensors;
  std::function<void(world_t*)> on_world;
  std::function<void(const std::string& module, transform_t*)> on_transform;
  std::function<void(const std::string& module, actuator_t*)> on_actuator;
  std::function<void(const std::string& module, status_t*)> on_status;
};

/// One event of a log.
struct SyntheticEvent {
  int64_t timestamp_us = 0;
  std::string channel;
  std::vector<uint8_t> payload;
};

/// The run's description, serialized.
std::string SyntheticDescription(const std::string& robot, const std::string& run);

/// The events in the order in which a recorder writes them.
std::vector<SyntheticEvent> SyntheticEvents(const SyntheticOptions& options);

/// As a file in LCM's format.
std::vector<uint8_t> EncodeLog(const std::vector<SyntheticEvent>& events);

/// Writes the log.
void WriteSyntheticLog(const std::string& path, const SyntheticOptions& options);

/// Writes bytes.
void WriteBytes(const std::string& path, const std::vector<uint8_t>& bytes);

}  // namespace morphbus::test
