#include <fmt/format.h>
#include <morphbus/vm/virtual_machine.h>

#include <algorithm>
#include <cmath>

#include "bridge/wire/stream_hash.h"
#include "bridge/wire/vm_codec.h"
#include "compiler/base/version.h"
#include "sim/connections.h"
#include "tools/libraries/model_content.h"
#include "tools/libraries/module_setup.h"
#include "vm/image/fault_text.h"
#include "vm/image/image_texts.h"
#include "vm/image/print_line.h"

namespace morphbus {
namespace {

/// Copies values of a module. Throws Failure for another number of them than it has.
template <class Number>
void Copy(const char* what, const std::vector<double>& values, int count, Number* to) {
  if (static_cast<int>(values.size()) != count) {
    throw Failure("a module with " + std::to_string(count) + " " + what + " gets " +
                  std::to_string(values.size()) + " values for them");
  }
  for (int i = 0; i < count; ++i) {
    if (!std::isfinite(values[i])) throw Failure(std::string(what) + ": a value is no number");
    to[i] = static_cast<Number>(values[i]);
  }
}

/// The value, if it is in its range; throws Failure otherwise.
int64_t InRange(const char* what, int64_t value, int64_t least, int64_t most) {
  if (value >= least && value <= most) return value;
  throw Failure(fmt::format("{}: expected {} to {}, and not {}", what, least, most, value));
}

Pose PoseToPublic(const vm::PoseF& X) {
  // Of the two quaternions that stand for a rotation the one with w >= 0 is told.
  const double sign = X.q.w < 0 ? -1 : 1;
  return {{static_cast<double>(X.p.x), static_cast<double>(X.p.y), static_cast<double>(X.p.z)},
          {sign * static_cast<double>(X.q.w), sign * static_cast<double>(X.q.x),
           sign * static_cast<double>(X.q.y), sign * static_cast<double>(X.q.z)}};
}

}  // namespace

class MORPHBUS_HIDDEN VirtualMachine::Content {
 public:
  Content(const Robot& robot, const Program& program, int module, uint64_t random_seed)
      : robot_(robot), module_(module), images_(ImagesOf(robot, program)) {
    if (module < 0 || module >= static_cast<int>(robot.modules().size())) {
      throw Failure("there is no module number " + std::to_string(module) + " in robot " +
                    robot.name());
    }
    bridge::ModuleSpec spec = SpecOf(robot, module);
    spec.random_seed = random_seed;
    auto created = bridge::ModuleInstance::Create(*images_, std::move(spec));
    if (!created) throw Failure(created.error().message);
    instance_ = std::move(*created);
  }

  [[nodiscard]] const vm::VerifiedKinematics& type() const { return instance_->type(); }

  [[nodiscard]] VmInput InputAtRest() const {
    VmInput input;
    input.position = robot_.content()->robot.modules[module_].start;
    input.velocity.resize(input.position.size());
    input.effort.resize(input.position.size());
    input.sensors.resize(static_cast<size_t>(type().num_sensor_values()));
    input.connectors.resize(static_cast<size_t>(type().num_connectors()));
    // The simulator's rule says how each connection is told.
    const sim::Connections connections(
        std::make_shared<model::Model>(robot_.content()->of_model->model), robot_.content()->robot);
    std::vector<morphbus::module_sensors_t> sensors(robot_.modules().size());
    connections.Sense(&sensors);
    vm::TickInput told;
    if (Result<void> read =
            bridge::FromSensors(Empty(sensors[module_]), 0, type().num_connectors(), 0, &told);
        !read) {
      throw Failure(read.error().message);
    }
    for (size_t c = 0; c < input.connectors.size(); ++c) {
      const vm::ConnectorReading& reading = told.connectors[c];
      input.connectors[c] = {reading.docked,
                             reading.mate_module,
                             reading.mate_connector,
                             reading.connection_type,
                             reading.number,
                             reading.is_member_b,
                             {}};
    }
    return input;
  }

  VmOutput Tick(const VmInput& input) {
    if (!usable_) throw Failure("this machine could not be loaded, and is of no use");
    vm::TickInput told;
    told.tick = InRange("tick", input.tick, 0, int64_t{1} << 48);
    if (!(input.time_s >= 0 && input.time_s <= 1e9)) {
      throw Failure("time_s: expected a sim time, 0 s or later");
    }
    told.sim_time_us = static_cast<int64_t>(input.time_s * 1e6 + 0.5);
    Copy("joints", input.position, type().num_joints(), told.joint_position);
    Copy("joints", input.velocity, type().num_joints(), told.joint_velocity);
    Copy("joints", input.effort, type().num_joints(), told.joint_effort);
    Copy("values of sensors", input.sensors, type().num_sensor_values(), told.sensor_values);
    Hear(input.connectors, &told);
    instance_->controller().Tick(told, &output_);
    return Said(input.tick);
  }

  [[nodiscard]] std::string Save() const {
    std::vector<uint8_t> bytes;
    instance_->controller().Save(&bytes);
    const std::string state(bytes.begin(), bytes.end());
    return Head(state) + state;
  }

  void Load(std::string_view saved) {
    // A state is taken as it is, so nothing may be one but what a machine like this has saved.
    const std::string expected = Head("");
    const std::string_view state = saved.substr(std::min(saved.size(), expected.size()));
    if (saved.substr(0, expected.size()) != Head(state)) {
      throw Failure(
          "this is no state of a machine of this module, program and version of Morphbus, or it is "
          "damaged");
    }
    const auto* bytes = reinterpret_cast<const uint8_t*>(state.data());
    usable_ = instance_->controller().Load(bytes, state.size());
    if (!usable_) throw Failure("this is no state of such a machine");
  }

 private:
  /// What a state begins with: whose it is, and its checksum. Always of one length.
  [[nodiscard]] std::string Head(std::string_view state) const {
    const auto* bytes = reinterpret_cast<const uint8_t*>(state.data());
    return fmt::format("{:<40.40}{:016x}{:016x}{:08x}{:016x}", Version(),
                       instance_->controller().program().hash(), type().hash(), module_,
                       bridge::DigestOf(bytes, state.size()));
  }

  /// A reading without joints and sensors: of connectors alone.
  static morphbus::module_sensors_t Empty(morphbus::module_sensors_t reading) {
    reading.num_joints = 0;
    reading.num_sensor_values = 0;
    return reading;
  }

  /// What the connectors sense, and what came from the neighbours there.
  void Hear(const std::vector<ConnectorInput>& connectors, vm::TickInput* told) {
    if (static_cast<int>(connectors.size()) != type().num_connectors()) {
      throw Failure("a module with " + std::to_string(type().num_connectors()) +
                    " connectors hears of " + std::to_string(connectors.size()));
    }
    heard_.resize(connectors.size());
    for (size_t c = 0; c < connectors.size(); ++c) {
      const ConnectorInput& at = connectors[c];
      told->connectors[c] = {
          at.docked,
          static_cast<uint16_t>(InRange("mate_module", at.mate_module, 0, 0x7fff)),
          static_cast<uint8_t>(
              InRange("mate_connector", at.mate_connector, 0, vm::kMaxConnectors - 1)),
          static_cast<uint8_t>(InRange("connection_type", at.connection_type, 0, 127)),
          static_cast<uint16_t>(InRange("number", at.number, 0, 0x7fff)),
          at.is_second};
      if (at.message.empty()) continue;
      const auto* bytes = reinterpret_cast<const uint8_t*>(at.message.data());
      const Result<void> read = bridge::DecodeTransform(bytes, at.message.size(), &heard_[c]);
      if (!read) throw Failure("a neighbour's message: " + read.error().message);
      told->messages[c] = &heard_[c];
    }
  }

  /// What the last tick comes to.
  VmOutput Said(int64_t tick) {
    VmOutput said;
    const vm::StatusReport& status = output_.status;
    for (int j = 0; j < type().num_joints(); ++j) {
      const vm::JointCommand& joint = output_.joints[j];
      said.joints.push_back(
          {static_cast<JointCommand::Mode>(joint.mode), joint.target, joint.speed});
    }
    std::vector<uint8_t> bytes;
    output_.message.tick = tick;
    bridge::EncodeTransform(output_.message, &bytes);
    said.message.assign(bytes.begin(), bytes.end());
    said.has_pose = output_.message.has_pose;
    for (int l = 0; said.has_pose && l < output_.message.num_links; ++l) {
      said.X_RL.push_back(PoseToPublic(output_.message.X_RL[l]));
    }
    const vm::VerifiedProgram& program = instance_->controller().program();
    if (status.role >= 0) {
      const vm::RoleInfo role = program.role(status.role);
      said.role = ToString(role.name);
      const ModuleType& names = TypeNames();
      for (int l = 0; l < status.num_labels && l < role.num_labels; ++l) {
        const bool is_joint = program.function(role.labels[l]).return_type == vm::ValueType::kJoint;
        const std::vector<std::string>& parts = is_joint ? names.joints : names.links;
        const auto part = static_cast<size_t>(status.labels[l]);
        if (part < parts.size()) {
          said.labels.emplace_back(ToString(program.member_name(role.labels[l])), parts[part]);
        }
      }
    }
    for (int f = 0; f < status.num_faults; ++f) {
      said.faults.push_back(vm::FaultSentence(status.faults[f], {&program, &type()}));
    }
    for (int p = 0; p < status.num_prints; ++p) {
      const vm::PrintReport& print = status.prints[p];
      said.prints.push_back(
          vm::PrintText(program, &type(), print.text, print.values, print.num_values));
    }
    return said;
  }

  /// The module's type by the names of its parts.
  [[nodiscard]] const ModuleType& TypeNames() const {
    const int of = robot_.content()->robot.modules[module_].type;
    return robot_.content()->of_model->module_types[of];
  }

  Robot robot_;
  int module_;
  std::unique_ptr<bridge::ModuleImages> images_;
  std::unique_ptr<bridge::ModuleInstance> instance_;
  /// What neighbours said, by connector; a tick's input refers to it.
  std::vector<vm::NeighbourMessage> heard_;
  vm::TickOutput output_;
  /// False once a state could not be loaded.
  bool usable_ = true;
};

VirtualMachine::VirtualMachine(const Robot& robot, const Program& program, int module,
                               uint64_t random_seed)
    : content_(std::make_unique<Content>(robot, program, module, random_seed)) {}
VirtualMachine::~VirtualMachine() = default;
VirtualMachine::VirtualMachine(VirtualMachine&& other) noexcept = default;
VirtualMachine& VirtualMachine::operator=(VirtualMachine&& other) noexcept = default;

VmOutput VirtualMachine::Tick(const VmInput& input) { return content_->Tick(input); }
VmInput VirtualMachine::InputAtRest() const { return content_->InputAtRest(); }
int VirtualMachine::num_sensor_values() const { return content_->type().num_sensor_values(); }
std::string VirtualMachine::Save() const { return content_->Save(); }
void VirtualMachine::Load(std::string_view state) { content_->Load(state); }

}  // namespace morphbus
