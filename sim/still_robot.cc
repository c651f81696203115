#include "sim/still_robot.h"

#include <algorithm>
#include <map>
#include <utility>

#include "compiler/base/disjoint_sets.h"

namespace morphbus::sim {

Result<std::unique_ptr<StillRobot>> StillRobot::Create(std::shared_ptr<const model::Model> model,
                                                       const std::string& robot, int tick_us,
                                                       int physics_step_us) {
  const model::Robot* found = model->FindRobot(robot);
  if (found == nullptr) return Fail("the model has no robot named " + robot);
  // No physics has to bear the step, so that it may be of any length.
  if (physics_step_us < 1 || tick_us < physics_step_us || tick_us % physics_step_us != 0) {
    return Fail("the control tick must be a multiple of the physics step");
  }
  return std::unique_ptr<StillRobot>(
      new StillRobot(std::move(model), *found, tick_us, physics_step_us));
}

StillRobot::StillRobot(std::shared_ptr<const model::Model> model, const model::Robot& robot,
                       int tick_us, int physics_step_us)
    : model_(std::move(model)),
      connections_(model_, robot),
      step_s_(physics_step_us * 1e-6),
      steps_(tick_us / physics_step_us) {
  // Every part that comes apart goes on from where its links were last.
  const model::JointValues start = model::StartValues(robot);
  for (const std::vector<model::Pose>& X_RL :
       model::ForwardKinematics(*model_, robot, start).X_RL) {
    X_RL_anchor_.push_back(X_RL.front());
  }
  // Servos count from the start values, as those of a robot with physics do.
  for (int m = 0; m < static_cast<int>(robot.modules.size()); ++m) {
    std::vector<StillJoint>& joints = joints_.emplace_back();
    for (const model::Joint& joint : model_->TypeOf(robot, m).joints) {
      StillJoint& still = joints.emplace_back();
      still.fixed = joint.type == model::JointType::kFixed;
      if (still.fixed) continue;
      // A start value a hair outside the limits widens them.
      still.start = start[m][joints.size() - 1];
      const ServoLimits limits{std::min(0.0, joint.lower - still.start),
                               std::max(0.0, joint.upper - still.start), joint.speed};
      // Without a body nothing is asked of a motor, so that the gain does not matter.
      still.servo = Servo(limits, 0);
    }
  }
}

void StillRobot::Sense(std::vector<morphbus::module_sensors_t>* out) {
  // What the last tick had is overwritten, which keeps its memory.
  out->resize(joints_.size());
  // A joint is where its set-point is, in the module's own values.
  for (size_t m = 0; m < joints_.size(); ++m) {
    morphbus::module_sensors_t& sensors = (*out)[m];
    sensors.joint_position_si.clear();
    sensors.joint_velocity_si.clear();
    sensors.sensor_value.clear();
    // Nothing weighs anything here.
    sensors.joint_effort_si.assign(joints_[m].size(), 0.0F);
    sensors.module_id = static_cast<int16_t>(m);
    sensors.name = connections_.robot().modules[m].name;
    sensors.num_joints = static_cast<int8_t>(joints_[m].size());
    for (const StillJoint& joint : joints_[m]) {
      sensors.joint_position_si.push_back(joint.start + joint.servo.set_point());
      sensors.joint_velocity_si.push_back(static_cast<float>(joint.velocity));
    }
    SenseNothing(static_cast<int>(m), &sensors);
  }
  connections_.Sense(out);
}

// Without a world there is nothing to see or touch; up is where it was at the start.
void StillRobot::SenseNothing(int module, morphbus::module_sensors_t* out) {
  const model::ModuleType& type = model_->TypeOf(connections_.robot(), module);
  if (type.sensors.empty()) return;
  // Not LinkPoses(): poses that are kept would make new anchors in Advance.
  const LinkPoseTable X_RL = ComputeLinkPoses();
  for (const model::Sensor& sensor : type.sensors) {
    if (sensor.type == model::SensorType::kTilt) {
      const Eigen::Vector3d up =
          X_RL[module][sensor.link].linear().transpose() * Eigen::Vector3d::UnitY();
      for (int k = 0; k < 3; ++k) out->sensor_value.push_back(static_cast<float>(up(k)));
    } else {
      const bool distance = sensor.type == model::SensorType::kDistance;
      out->sensor_value.push_back(distance ? static_cast<float>(sensor.range_m) : 0.0F);
    }
  }
  out->num_sensor_values = static_cast<int8_t>(out->sensor_value.size());
}

void StillRobot::Actuate(const morphbus::actuator_t& command) {
  if (command.module_id < 0 || command.module_id >= static_cast<int>(joints_.size())) return;
  // The poses are those before any change, which moves nothing.
  if (!command.connectors.empty()) LinkPoses();
  for (const morphbus::connector_command_t& connector : command.connectors) {
    connections_.Command(command.module_id, connector, [this] { return LinkPoses(); });
  }
  // Joints beyond those that the module has are ignored.
  std::vector<StillJoint>& joints = joints_[command.module_id];
  for (size_t j = 0; j < std::min(joints.size(), command.joints.size()); ++j) {
    if (joints[j].fixed) continue;
    joints[j].servo.Command(ToServo(command.joints[j], joints[j].start, 1.0));
  }
}

void StillRobot::Advance() {
  // Parts that came to be in this tick go on from where their links were.
  if (X_RL_) {
    for (size_t m = 0; m < joints_.size(); ++m) X_RL_anchor_[m] = (*X_RL_)[m].front();
    X_RL_.reset();
  }
  for (std::vector<StillJoint>& module : joints_) {
    for (StillJoint& joint : module) {
      const double before = joint.servo.set_point();
      // The joint is where its set-point is, so the servo never waits for it.
      for (int i = 0; i < steps_; ++i) joint.servo.Step(joint.servo.set_point(), 0, step_s_);
      joint.velocity = (joint.servo.set_point() - before) / (steps_ * step_s_);
    }
  }
}

Result<void> StillRobot::Disconnect(const std::string& module, const std::string& connector) {
  // Asked for while the parts still hang together: afterwards nothing tells where the new part is.
  LinkPoses();
  return connections_.Disconnect(module, connector);
}

Result<void> StillRobot::Connect(const std::string& module, const std::string& connector,
                                 const std::string& mate_module,
                                 const std::string& mate_connector) {
  return connections_.Connect(
      module, connector, [this] { return LinkPoses(); }, mate_module, mate_connector);
}

Result<void> StillRobot::Push(const std::string&, const Eigen::Vector3d&, const std::string&,
                              double) {
  return Fail("this run is without physics (--still): nothing can be pushed");
}

void StillRobot::Lose(int module) {
  for (StillJoint& joint : joints_[module]) joint.servo.Command({});
}

const LinkPoseTable& StillRobot::LinkPoses() {
  if (!X_RL_) X_RL_ = ComputeLinkPoses();
  return *X_RL_;
}

LinkPoseTable StillRobot::ComputeLinkPoses() const {
  const model::Robot& robot = connections_.robot();
  const int num_modules = static_cast<int>(robot.modules.size());
  // What hangs together is a part, numbered by its first module.
  DisjointSets parts(num_modules);
  for (const model::Docking& docking : robot.dockings) {
    parts.Unite(docking.module_a, docking.module_b);
  }
  std::map<int, std::vector<int>> modules_of;
  for (int m = 0; m < num_modules; ++m) modules_of[parts.Find(m)].push_back(m);
  LinkPoseTable X_RL(num_modules);
  for (const auto& [root, modules] : modules_of) AddPartPoses(modules, &X_RL);
  return X_RL;
}

void StillRobot::AddPartPoses(const std::vector<int>& modules, LinkPoseTable* X_RL) const {
  const model::Robot& robot = connections_.robot();
  // The part as a robot of its own, with its modules at their present joint values.
  model::Robot part;
  model::JointValues q;
  std::vector<int> number_in_part(robot.modules.size(), -1);
  for (const int m : modules) {
    number_in_part[m] = static_cast<int>(part.modules.size());
    part.modules.push_back(robot.modules[m]);
    std::vector<double>& values = q.emplace_back();
    for (const StillJoint& joint : joints_[m]) {
      values.push_back(joint.start + joint.servo.set_point());
    }
  }
  // Its connections, under the numbers that the modules have in it.
  for (model::Docking docking : robot.dockings) {
    // A docking has both modules in one part, or neither.
    if (number_in_part[docking.module_a] < 0) continue;
    docking.module_a = number_in_part[docking.module_a];
    docking.module_b = number_in_part[docking.module_b];
    part.dockings.push_back(docking);
  }
  // Its first module's first link is its root, and stays where it was.
  part.X_LR = X_RL_anchor_[modules.front()].inverse();
  std::vector<std::vector<model::Pose>> poses = model::ForwardKinematics(*model_, part, q).X_RL;
  for (size_t i = 0; i < modules.size(); ++i) (*X_RL)[modules[i]] = std::move(poses[i]);
}

}  // namespace morphbus::sim
