#pragma once
// A log of a run as typed time series: what was sensed, told, commanded, simulated and reported, by
// tick; and an account of what is in the file, what is missing and what is damaged.

#include <cstdint>
#include <map>
#include <memory>
#include <morphbus/actuator_t.hpp>
#include <morphbus/body_pose_t.hpp>
#include <morphbus/contact_force_t.hpp>
#include <morphbus/health_t.hpp>
#include <morphbus/log_end_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <morphbus/pose_t.hpp>
#include <morphbus/status_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bridge/description/link_places.h"
#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "logger/log/event_log.h"
#include "logger/log/run_facts.h"

namespace morphbus::bridge {
struct RunModel;
}

namespace morphbus::logger {

/// What one module sensed at the start of a tick: its part of a SENSORS message.
struct SensorSample {
  /// Sim time of the tick's start, µs since the run's start.
  int64_t time_us = 0;
  /// Measured angles (rad) or travels (m) of the joints, in declaration order; the sign is that of
  /// the joint's first link.
  std::vector<double> position;
  /// Their rates (rad/s or m/s), in the same order.
  std::vector<double> velocity;
  /// The connectors that were mated, and with what.
  std::vector<morphbus::docked_connector_t> docked;
  /// What the sensors measured, one behind the other, as in module_sensors_t.
  std::vector<float> values = {};
  /// What the motors of the joints exerted in the tick before, mean over it (N m or N), in the sign
  /// of `position`; 0 at the start.
  std::vector<float> effort = {};
};

/// What one module told its neighbours in a tick: its TRANSFORM, as far as poses go.
struct TransformSample {
  int64_t time_us = 0;
  /// The module's role as an index in the program's role table; -1 while it has none.
  int16_t role = -1;
  /// Whether X_RL means anything: false until the root's pose has come to the module.
  bool has_pose = false;
  /// True if the root has gone silent and the poses age.
  bool pose_stale = false;
  /// Pose of each link L in the robot frame R (m), in declaration order, as the module's VM knows
  /// it.
  std::vector<morphbus::pose_t> X_RL;
};

/// What one module commanded in a tick: its ACTUATOR.
struct ActuatorSample {
  int64_t time_us = 0;
  /// One command for each joint in declaration order, in the actuators' sign (rad or m, and per
  /// second).
  std::vector<morphbus::joint_command_t> joints;
  /// State changes asked for in this tick; empty in most.
  std::vector<morphbus::connector_command_t> connectors;
};

/// What one module reported of itself. A tick with many faults has several of one time; a report
/// that only tells of traced fields anew has none.
struct StatusSample {
  int64_t time_us = 0;
  int64_t tick = 0;
  /// Without faults and printed lines, which are told elsewhere.
  morphbus::status_t status;
};

/// The value of one field that a program traces, in one tick.
struct TraceSample {
  int64_t time_us = 0;
  int64_t tick = 0;
  uint64_t program_hash = 0;
  int role = -1;  ///< In the program.
  std::string role_name;
  vm::TraceReport trace;
};

/// Where the simulated bodies were at the start of a tick, all parts of WORLD together.
struct WorldSample {
  int64_t time_us = 0;
  /// Pose X_WL (m) of the link that stands for each body, in the world (NUE, ground at y = 0).
  std::vector<morphbus::body_pose_t> bodies;
  /// What the ground and obstacles exerted on links in the tick before (N, in W).
  std::vector<morphbus::contact_force_t> contacts = {};
};

/// All that one module said and sensed. Each series is in order of sim time, with one sample a time
/// but for `status`. Ticks whose messages are missing have no sample.
struct ModuleSeries {
  /// The module's name, by which its channels are called.
  std::string name;
  /// Number of the module in SENSORS, by which messages name their mates; -1 if SENSORS never named
  /// it.
  int id = -1;
  /// Index into Robot::modules; -1 if there is no model or it does not have the module.
  int model_index = -1;
  std::vector<SensorSample> sensors;
  std::vector<TransformSample> transforms;
  std::vector<ActuatorSample> actuators;
  std::vector<StatusSample> status;
  /// With RunLogOptions::traces.
  std::vector<TraceSample> traces;
};

/// A run as it was logged: what LoadRunLog() returns. It is whole by itself and refers to nothing
/// that must outlive it.
struct RunLog {
  /// What the file holds, what is missing and what is damaged.
  LogFacts facts;
  /// The serialized morphbus.proto.RunDescription; empty if the log does not hold it whole.
  std::string description;
  /// Images that were deployed while it ran, by hash, as SENSORS handed them over; not verified.
  std::map<uint64_t, std::string> deployed;
  /// What it says; null if it is missing or cannot be read.
  std::shared_ptr<const bridge::RunModel> described;
  /// The model in it; null if there is none or it is unusable (facts.problems says why).
  std::shared_ptr<const model::Model> model;
  /// The robot that ran, within *model; null without one.
  const model::Robot* robot = nullptr;
  /// In the order of Robot::modules; modules that the model lacks follow in order of id.
  std::vector<ModuleSeries> modules;
  /// The simulated world, in order of time; empty for a run without a simulator's WORLD.
  std::vector<WorldSample> world;
  /// Sim time (µs) of every control tick that a CLOCK dates, ascending.
  std::vector<int64_t> ticks_us;
  /// Length of a control tick, µs of sim time; 0 if no CLOCK was seen.
  int32_t tick_us = 0;
  /// By how much sim time a message of the run stands behind a later one in the file at most, µs.
  int64_t disorder_us = 0;

  /// The module of that name; null if the run has none.
  [[nodiscard]] const ModuleSeries* FindModule(const std::string& name) const;
};

/// Index of each module in the model by its number in SENSORS, by which SENSORS and WORLD name it;
/// modules that the model lacks are left out.
std::map<int, int> ModelIndices(const RunLog& log);
/// The index of a module by its number; -1 if there is none.
int IndexById(const std::map<int, int>& indices, int id);
/// What a connector senses, with the mate by its index.
morphbus::docked_connector_t WithModelIndex(const std::map<int, int>& model_indices,
                                            morphbus::docked_connector_t docked);
/// What was sensed to be docked at a sim time (µs), by model index. A module's last sample that is
/// not later counts: of one that has none later, since it was lost or the log ends, the last of
/// all. Before a module's first sample it counts as docked as the robot declares it.
bridge::Dockings DockingsAt(const RunLog& log, const std::map<int, int>& model_indices,
                            int64_t time_us);

/// What to read.
struct RunLogOptions {
  /// Which run, if the file holds several; empty for the first that has INFO or CLOCK.
  std::string run;
  /// False to leave the series empty, as `info` and `verify` do: memory then stays small for a log
  /// of any length.
  bool series = true;
  /// Without series, keep of them what says who played which role: STATUS, and of TRANSFORM the
  /// message with which a role was taken and the first with poses after it. SeriesReader reads the
  /// rest.
  bool outline = false;
  /// A serialized description (ReadDescription) for a log that holds none whole: a recording that
  /// was begun after the run. A log that has its own keeps to it. Empty: none.
  std::string description = {};
  /// So many faults are kept in LogFacts::faults, the first ones; all are counted.
  size_t max_faults = 1000;
  /// Keep the values of traced fields: some for every tick.
  bool traces = false;
};

/// Reads the log at `path` front to back. It fails only if the file cannot be read at all, holds no
/// run of modules, or not the one that `options` names (the error lists those that it holds), or if
/// the description that `options` lends it is of another model.
/// Damage never makes it fail: it is read past and listed in `facts`, each place with its byte and
/// the sim time up to which the log was whole. An event that is damaged is in no series.
Result<RunLog> LoadRunLog(const std::string& path, const RunLogOptions& options = {});

}  // namespace morphbus::logger
