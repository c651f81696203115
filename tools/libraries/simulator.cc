#include <morphbus/bus/simulator.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "bridge/lockstep/sim/sim_participant.h"
#include "compiler/model/kinematic_graph.h"
#include "sim/connections.h"
#include "tools/libraries/model_content.h"
#include "tools/libraries/module_setup.h"
#include "tools/libraries/run_bus.h"

namespace morphbus {
namespace {

/// A simulator of one's own as the lockstep drives it. What it throws is kept, and ends the run.
class OwnRobot : public bridge::SimulatedRobot {
 public:
  /// @param sensor_values  by module, how many values its sensors measure.
  OwnRobot(const Robot& robot, Simulator* simulator, double tick_s, std::vector<int> sensor_values)
      : robot_(robot),
        sensor_values_(std::move(sensor_values)),
        simulator_(*simulator),
        tick_s_(tick_s),
        connections_(std::make_shared<model::Model>(robot.content()->of_model->model),
                     robot.content()->robot) {
    // A body is told of by its first link.
    const auto body_of = model::BodiesOf(robot.content()->of_model->model, robot.content()->robot);
    std::vector<bool> told;
    for (size_t m = 0; m < body_of.size(); ++m) {
      for (size_t l = 0; l < body_of[m].size(); ++l) {
        const auto body = static_cast<size_t>(body_of[m][l]);
        if (told.size() <= body) told.resize(body + 1, false);
        if (!told[body]) bodies_.push_back({static_cast<int>(m), static_cast<int>(l)});
        told[body] = true;
      }
    }
  }

  void Sense(std::vector<morphbus::module_sensors_t>* out) override {
    out->resize(robot_.modules().size());
    for (size_t m = 0; m < out->size(); ++m) {
      morphbus::module_sensors_t& told = (*out)[m];
      told.module_id = static_cast<int16_t>(m);
      told.name = robot_.modules()[m].name;
      Keep([&] { Fill(static_cast<int>(m), simulator_.Sense(static_cast<int>(m)), &told); });
    }
    connections_.Sense(out);
  }

  void Truth(std::vector<morphbus::body_pose_t>* out) override {
    out->clear();
    for (const model::LinkRef& body : bodies_) {
      std::optional<Pose> X_WL;
      Keep([&] {
        X_WL = simulator_.LinkPose(robot_.content()->first_link[body.module] + body.link);
      });
      if (!X_WL) continue;
      Keep([&] { CheckPose(*X_WL); });
      if (thrown_) return;
      morphbus::body_pose_t& told = out->emplace_back();
      told.module_id = static_cast<int16_t>(body.module);
      told.link = static_cast<int8_t>(body.link);
      std::ranges::copy(X_WL->position, told.position_m);
      std::ranges::copy(X_WL->rotation, told.orientation_wxyz);
    }
  }

  void Actuate(const morphbus::actuator_t& command) override {
    std::vector<JointCommand> joints;
    for (const morphbus::joint_command_t& joint : command.joints) {
      joints.push_back(
          {static_cast<JointCommand::Mode>(joint.mode), joint.target_si, joint.speed_si});
    }
    Keep([&] { simulator_.Command(command.module_id, joints); });
  }

  void Advance() override {
    Keep([&] { simulator_.Step(tick_s_); });
  }

  [[nodiscard]] std::string Breakdown() const override {
    return thrown_ ? "the simulator has given up" : "";
  }
  [[nodiscard]] const std::exception_ptr& thrown() const { return thrown_; }

 private:
  /// Calls the simulator, unless it has thrown before.
  template <class Call>
  void Keep(const Call& call) {
    if (thrown_) return;
    try {
      call();
    } catch (...) {
      thrown_ = std::current_exception();
    }
  }

  /// Throws Failure for what is no pose.
  static void CheckPose(const Pose& X) {
    double square = 0;
    for (const double v : X.rotation) square += v * v;
    const bool finite = std::ranges::all_of(X.position, [](double v) { return std::isfinite(v); });
    if (!finite || !(std::abs(square - 1) < 1e-6)) {
      throw Failure("a link's pose is none: its rotation is a quaternion of length 1");
    }
  }

  /// Puts a reading into a message. Throws Failure where it is of the wrong size.
  void Fill(int module, const ModuleReading& reading, morphbus::module_sensors_t* told) const {
    const size_t joints = robot_.content()->robot.modules[module].start.size();
    for (const std::vector<double>* values :
         {&reading.position, &reading.velocity, &reading.effort}) {
      if (values->size() == joints) continue;
      throw Failure("module " + told->name + " has " + std::to_string(joints) +
                    " joints, and its reading " + std::to_string(values->size()) + " values");
    }
    if (reading.sensors.size() != static_cast<size_t>(sensor_values_[module])) {
      throw Failure("the sensors of module " + told->name + " measure " +
                    std::to_string(sensor_values_[module]) + " values, and its reading has " +
                    std::to_string(reading.sensors.size()));
    }
    for (const std::vector<double>* values :
         {&reading.position, &reading.velocity, &reading.effort, &reading.sensors}) {
      if (std::ranges::all_of(*values, [](double v) { return std::isfinite(v); })) continue;
      throw Failure("a value of module " + told->name + " is no number");
    }
    told->num_joints = static_cast<int8_t>(joints);
    told->joint_position_si = reading.position;
    told->joint_velocity_si.assign(reading.velocity.begin(), reading.velocity.end());
    told->joint_effort_si.assign(reading.effort.begin(), reading.effort.end());
    told->num_sensor_values = static_cast<int8_t>(reading.sensors.size());
    told->sensor_value.assign(reading.sensors.begin(), reading.sensors.end());
  }

  const Robot& robot_;
  std::vector<int> sensor_values_;
  Simulator& simulator_;
  double tick_s_;
  sim::Connections connections_;
  std::vector<model::LinkRef> bodies_;
  std::exception_ptr thrown_;
};

/// By module, how many values its sensors measure.
std::vector<int> SensorValuesOf(const Robot& robot, const Program& program) {
  const std::unique_ptr<bridge::ModuleImages> images = ImagesOf(robot, program);
  std::vector<int> counts;
  for (const Module& module : robot.modules()) {
    counts.push_back(images->FindKinematics(module.type)->num_sensor_values());
  }
  return counts;
}

/// What the run is, and whom it needs.
bridge::SimParticipantOptions OptionsOf(const Robot& robot, const Program& program,
                                        const RunAddress& address,
                                        const SimulationOptions& options) {
  bridge::SimParticipantOptions told;
  if (!(options.seconds >= 0 && options.seconds <= 1e6)) {
    throw Failure("seconds: expected 0 (until stopped) to 1000000");
  }
  if (!(options.speed >= 0)) throw Failure("speed: expected times real time, or 0");
  if (!(options.give_up_s >= 1 && options.give_up_s <= 1e6)) {
    throw Failure("give_up_s: expected 1 to 1000000");
  }
  told.run = address.run;
  told.model_hash = ModelHashOf(robot);
  told.program_hash = program.hash();
  told.logger = options.logger;
  told.num_ticks = options.seconds > 0
                       ? std::max<int64_t>(1, std::llround(options.seconds * 1e6 / told.tick_us))
                       : -1;
  told.realtime = options.realtime;
  told.speed = options.speed;
  told.timing.join_silence_us = std::llround(options.give_up_s * 1e6);
  const std::unique_ptr<bridge::ModuleImages> images = ImagesOf(robot, program);
  for (size_t m = 0; m < robot.modules().size(); ++m) {
    const vm::VerifiedKinematics* type = images->FindKinematics(robot.modules()[m].type);
    told.modules.push_back({robot.modules()[m].name, static_cast<uint16_t>(m),
                            robot.modules()[m].type, type->hash(), type->num_connectors()});
  }
  return told;
}

}  // namespace

SimulationResult Simulate(const Robot& robot, const Program& program, const RunAddress& address,
                          Simulator* simulator, const SimulationOptions& options,
                          const std::atomic<bool>* stop) {
  const bridge::SimParticipantOptions told = OptionsOf(robot, program, address, options);
  RunBus bus(address);
  OwnRobot own(robot, simulator, told.tick_us / 1e6, SensorValuesOf(robot, program));
  const bridge::MonotonicTime time;
  bridge::SimParticipant participant(bus.bus(), &own, &time, told);
  bool stopping = false;
  Watch watch(&time, [&] {
    if (stopping || stop == nullptr || !stop->load()) return;
    stopping = true;
    participant.RequestStop("stopped");
  });
  bridge::RunParticipants(bus.bus(), time, {&participant, &watch}, nullptr,
                          [&participant] { participant.PublishHealth(); });
  if (own.thrown()) std::rethrow_exception(own.thrown());
  const bridge::SimOutcome& outcome = participant.outcome();
  if (!outcome.ok) throw Failure(outcome.error);
  return {outcome.run_hash, outcome.ticks, outcome.reason};
}

}  // namespace morphbus
