#pragma once
// A log of a run as typed time series: what was sensed, told, commanded, simulated and reported, by
// tick; and an account of what is in the file, what is missing and what is damaged.

#include <cstdint>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <morphbus/pose_t.hpp>
#include <morphbus/status_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "compiler/model/robot_model.h"
#include "compiler/source/result.h"
#include "logger/event_log.h"
#include "logger/run_facts.h"

namespace morphbus::logger {

/// What one module sensed at the start of a tick.
struct SensorSample {
  int64_t time_us = 0;           ///< Sim time.
  std::vector<double> position;  ///< Joint angles (rad) or travels (m), declaration order.
  std::vector<morphbus::docked_connector_t> docked;
};

/// What one module told its neighbours.
struct TransformSample {
  int64_t time_us = 0;
  int16_t role = -1;  ///< Index in the program's role table.
  bool has_pose = false;
  bool pose_stale = false;
  std::vector<morphbus::pose_t> X_RL;  ///< By link, in the robot frame as the VMs know it.
};

/// What one module commanded.
struct ActuatorSample {
  int64_t time_us = 0;
  std::vector<morphbus::joint_command_t> joints;
  std::vector<morphbus::connector_command_t> connectors;
};

/// What one module reported. Several may have one time.
struct StatusSample {
  int64_t time_us = 0;
  int64_t tick = 0;
  morphbus::status_t status;
};

/// Where the simulated bodies were, all parts of a tick together.
struct WorldSample {
  int64_t time_us = 0;
  std::vector<morphbus::body_pose_t> bodies;
};

/// All that one module said and sensed; each series in order of time, one sample a time.
struct ModuleSeries {
  std::string name;
  int id = -1;           ///< As in SENSORS; -1 if SENSORS never named it.
  int model_index = -1;  ///< Index into Robot::modules; -1 if the model does not have it.
  std::vector<SensorSample> sensors;
  std::vector<TransformSample> transforms;
  std::vector<ActuatorSample> actuators;
  std::vector<StatusSample> status;
};

/// A run as it was logged.
struct RunLog {
  LogFacts facts;
  /// The serialized morphbus.proto.RunDescription; empty if the log does not hold it whole.
  std::string description;
  /// From the description; null if there is none or it is unusable (facts.problems says why).
  std::shared_ptr<const model::Model> model;
  const model::Robot* robot = nullptr;  ///< In *model; null without one.
  std::vector<ModuleSeries> modules;    ///< In order of name as the robot has them, else by id.
  std::vector<WorldSample> world;
  std::vector<int64_t> ticks_us;  ///< Sim time of every CLOCK.
  int32_t tick_us = 0;            ///< Control tick; 0 if no CLOCK was seen.

  [[nodiscard]] const ModuleSeries* FindModule(const std::string& name) const;
};

struct RunLogOptions {
  std::string run;  ///< Which run, if the file holds several; empty: the first with INFO or CLOCK.
  bool series = true;  ///< False: facts only (for `info` and `verify`); memory stays small.
};

/// Reads a whole log. Fails only if the file cannot be read at all, or holds no run or not the one
/// that `options` names (the error lists those it holds); damage is read past, and listed in
/// `facts`.
Result<RunLog> LoadRunLog(const std::string& path, const RunLogOptions& options = {});

}  // namespace morphbus::logger
