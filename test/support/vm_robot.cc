#include "test/support/vm_robot.h"

#include <algorithm>
#include <cmath>

#include "compiler/base/check.h"
#include "compiler/emit/kinematics.h"
#include "vm/image/image.h"
#include "vm/image/kinematics_tables.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/verifier.h"
#include "vm/limits.h"

namespace morphbus::test {

namespace {

constexpr size_t kHistory = 6;  // Ticks that a late message may be late.

vm::Vec3 ToVec3(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

bool SamePose(const model::Pose& a, const model::Pose& b) { return a.isApprox(b, 1e-9); }

/// The option by which a connection looks from member b's side, if it has one.
const model::ConnectionOption* Mirror(const model::ConnectionType& type,
                                      const model::ConnectionOption& option) {
  if (type.type_a != type.type_b) return nullptr;
  for (const model::ConnectionOption& other : type.options) {
    if (other.connector_a == option.connector_b && other.connector_b == option.connector_a &&
        SamePose(other.X_AB, option.X_AB.inverse())) {
      return &other;
    }
  }
  return nullptr;
}

}  // namespace

vm::PoseF ToFloat(const model::Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  return {ToVec3(Eigen::Vector3d(X.translation())),
          vm::Normalize({static_cast<float>(q.w()), static_cast<float>(q.x()),
                         static_cast<float>(q.y()), static_cast<float>(q.z())})};
}

vm::KinematicsTables TablesOf(const model::Model& model, int module_type) {
  const auto tables = emit::KinematicsTablesOf(model, module_type, 0);
  MORPHBUS_CHECK(tables.has_value());
  return *tables;
}

std::vector<uint8_t> EmptyProgram() {
  namespace image = vm::image;
  std::vector<uint8_t> bytes(image::kHeaderBytes, 0);
  const auto put = [&bytes](uint32_t at, uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes[at + static_cast<uint32_t>(i)] = value >> (8 * i) & 0xff;
  };
  put(0, image::kMagic, 4);
  put(image::kVersionAt, image::kVersion, 2);
  put(image::kSettleTicksAt, image::kDefaultSettleTicks, 2);
  put(image::kSizeAt, image::kHeaderBytes, 4);
  put(image::kBudgetAt, image::kDefaultBudget, 4);
  put(image::kHashAt, image::HashOf(bytes.data(), image::kHeaderBytes), 8);
  return bytes;
}

VmRobot::VmRobot(const model::Model& model, const model::Robot& robot,
                 const std::vector<uint8_t>& program, const VmRobotOptions& options)
    : model_(model),
      robot_(robot),
      options_(options),
      docked_(robot.dockings.size(), true),
      q_(model::StartValues(robot)),
      random_(options.seed) {
  LoadKinematics();
  program_ = Load(program);
  const model::KinematicState rest = model::ForwardKinematics(model, robot, q_);
  const int root = options.root < 0 ? robot.root_module : options.root;
  nodes_.resize(robot.modules.size());
  for (int m = 0; m < size(); ++m) {
    Node& node = nodes_[Index(m)];
    const int type = robot.modules[Index(m)].type;
    node.kinematics = kinematics_[Index(type)].get();
    node.config.module_id = static_cast<uint16_t>(m + 1);
    node.config.is_root = m == root;
    node.config.grace_ticks = options.grace_ticks;
    const int root_link = options.root < 0 ? robot.root_link : 0;
    node.config.root_link = static_cast<uint8_t>(node.config.is_root ? root_link : 0);
    if (node.config.is_root) {
      node.config.X_RL_root = ToFloat(rest.X_RL[Index(m)][Index(root_link)]);
    }
    node.state = std::make_unique<vm::VmState>();
    node.output = std::make_unique<vm::TickOutput>();
    node.vm = std::make_unique<vm::Vm>(node.config, *node.kinematics, *program_, node.state.get());
    blocked_.emplace_back(model.TypeOf(robot, m).joints.size(), false);
    sensors_.emplace_back(vm::kMaxSensorValues, 0.0F);
    efforts_.emplace_back(vm::kMaxJoints, 0.0F);
  }
}

void VmRobot::LoadKinematics() {
  for (const morphbus_kinematics* tables : options_.tables) {
    kinematics_.push_back(std::make_unique<vm::VerifiedKinematics>());
    MORPHBUS_CHECK(vm::VerifyTables(*tables, kinematics_.back().get()).message == nullptr);
  }
  if (!options_.tables.empty()) return;
  for (size_t t = 0; t < model_.module_types.size(); ++t) {
    std::string error;
    kinematics_bytes_.push_back(
        vm::EncodeKinematics(TablesOf(model_, static_cast<int>(t)), &error));
    MORPHBUS_CHECK(error.empty());
  }
  for (const std::vector<uint8_t>& bytes : kinematics_bytes_) {
    kinematics_.push_back(std::make_unique<vm::VerifiedKinematics>());
    const vm::VerifyError error = vm::VerifyKinematics(
        bytes.data(), static_cast<uint32_t>(bytes.size()), kinematics_.back().get());
    MORPHBUS_CHECK(error.message == nullptr);
  }
}

const vm::VerifiedProgram* VmRobot::Load(const std::vector<uint8_t>& program) {
  program_bytes_.push_back(program);
  programs_.push_back(std::make_unique<vm::VerifiedProgram>());
  const std::vector<uint8_t>& bytes = program_bytes_.back();
  const vm::VerifyError error = vm::Verifier::Verify(
      bytes.data(), static_cast<uint32_t>(bytes.size()), programs_.back().get());
  if (error.message != nullptr) std::fprintf(stderr, "image refused: %s\n", error.message);
  MORPHBUS_CHECK(error.message == nullptr);
  return programs_.back().get();
}

void VmRobot::Connect(int module, vm::TickInput* input) {
  for (size_t d = 0; d < robot_.dockings.size(); ++d) {
    const model::Docking& docking = robot_.dockings[d];
    if (!docked_[d]) continue;
    const model::ConnectionType& type = model_.connection_types[Index(docking.connection_type)];
    const model::ConnectionOption& option = type.options[Index(docking.option)];
    for (const bool as_b : {false, true}) {
      if ((as_b ? docking.module_b : docking.module_a) != module) continue;
      vm::ConnectorReading reading;
      reading.docked = true;
      const int mate = as_b ? docking.module_a : docking.module_b;
      const int own = as_b ? docking.connector_b : docking.connector_a;
      reading.mate_module = static_cast<uint16_t>(mate + 1);
      reading.mate_connector =
          static_cast<uint8_t>(as_b ? docking.connector_a : docking.connector_b);
      reading.connection_type = static_cast<uint8_t>(docking.connection_type);
      const model::ConnectionOption* mirror = as_b ? Mirror(type, option) : nullptr;
      reading.is_member_b = options_.tells_member && as_b && mirror == nullptr;
      reading.number = static_cast<uint16_t>(mirror != nullptr ? mirror->number : option.number);
      input->connectors[own] = reading;
      input->messages[own] = Deliver(mate);
    }
  }
}

const vm::NeighbourMessage* VmRobot::Deliver(int from) {
  if (history_.empty()) return nullptr;
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  if (options_.loss > 0 && chance(random_) < options_.loss) return nullptr;
  size_t age = 0;
  if (options_.late > 0 && chance(random_) < options_.late) age = random_() % history_.size();
  return history_[age][Index(from)].get();
}

void VmRobot::Tick(int count) {
  for (int i = 0; i < count; ++i) {
    ++tick_;
    for (int m = 0; m < size(); ++m) {
      Node& node = nodes_[Index(m)];
      if (node.silent) continue;
      vm::TickInput input;
      input.tick = tick_;
      input.sim_time_us = tick_ * options_.tick_us;
      for (size_t j = 0; j < q_[Index(m)].size(); ++j) {
        input.joint_position[j] = q_[Index(m)][j];
        if (!speeds_.empty()) input.joint_velocity[j] = speeds_[Index(m)][j];
      }
      std::copy(efforts_[Index(m)].begin(), efforts_[Index(m)].end(), input.joint_effort);
      std::copy(sensors_[Index(m)].begin(), sensors_[Index(m)].end(), input.sensor_values);
      if (X_RL_sensed_ && node.config.is_root) {
        input.has_root_pose = true;
        input.root_link = sensed_link_;
        input.X_RL_root = *X_RL_sensed_;
      }
      Connect(m, &input);
      while (!node.requests.empty() && input.num_requests < vm::kMaxRequests) {
        input.requests[input.num_requests++] = node.requests.front();
        node.requests.erase(node.requests.begin());
      }
      const auto begun = std::chrono::steady_clock::now();
      node.vm->Tick(input, node.output.get());
      vm_time_ += std::chrono::steady_clock::now() - begun;
      const vm::StatusReport& status = node.output->status;
      for (int f = 0; f < status.num_faults; ++f) {
        faults_.push_back({tick_, m, status.faults[f]});
      }
    }
    history_.emplace_front();
    for (const Node& node : nodes_) {
      history_.front().push_back(
          node.silent ? nullptr : std::make_unique<vm::NeighbourMessage>(node.output->message));
    }
    if (history_.size() > kHistory) history_.pop_back();
    MoveJoints();
  }
}

void VmRobot::MoveJoints() {
  const double dt = static_cast<double>(options_.tick_us) * 1e-6;
  const model::JointValues before = q_;
  for (int m = 0; m < size(); ++m) {
    for (size_t j = 0; j < q_[Index(m)].size(); ++j) {
      if (blocked_[Index(m)][j]) continue;
      const vm::JointCommand& command = nodes_[Index(m)].output->joints[j];
      double& q = q_[Index(m)][j];
      if (command.mode == vm::ActuatorMode::kVelocity) q += command.speed * dt;
      if (command.mode != vm::ActuatorMode::kPosition) continue;
      const double step = options_.instant_servo ? INFINITY : command.speed * dt;
      q += std::clamp(command.target - q, -step, step);
    }
  }
  speeds_ = q_;
  for (size_t m = 0; m < q_.size(); ++m) {
    for (size_t j = 0; j < q_[m].size(); ++j) speeds_[m][j] = (q_[m][j] - before[m][j]) / dt;
  }
}

int VmRobot::ModuleNamed(const std::string& name) const { return robot_.FindModule(name).value(); }

std::string VmRobot::RoleOf(int m) const {
  const int role = output(m).status.role;
  if (role < 0) return "";
  const vm::Text name = program_->role(role).name;
  return {name.data, name.size};
}

int VmRobot::RoleNamed(const std::string& wanted) const {
  for (int i = 0; i < program_->num_roles(); ++i) {
    const vm::Text name = program_->role(i).name;
    if (wanted == std::string(name.data, name.size)) return i;
  }
  return -1;
}

int VmRobot::LabelOf(int m, const std::string& label) const {
  const vm::StatusReport& status = output(m).status;
  if (status.role < 0) return -1;
  const vm::RoleInfo role = program_->role(status.role);
  for (int i = 0; i < role.num_labels; ++i) {
    const vm::Text name = program_->member_name(role.labels[i]);
    if (label == std::string(name.data, name.size)) return status.labels[i];
  }
  return -1;
}

int VmRobot::DockingAt(int module, const std::string& connector) const {
  for (size_t d = 0; d < robot_.dockings.size(); ++d) {
    const model::Docking& docking = robot_.dockings[d];
    const auto named = [&](int m, int c) {
      return m == module && model_.TypeOf(robot_, m).connectors[Index(c)].name == connector;
    };
    if (named(docking.module_a, docking.connector_a) ||
        named(docking.module_b, docking.connector_b)) {
      return static_cast<int>(d);
    }
  }
  return -1;
}

void VmRobot::ColdStart(int module) {
  Node& node = nodes_[Index(module)];
  ++node.config.incarnation;
  node.vm = std::make_unique<vm::Vm>(node.config, *node.kinematics, *program_, node.state.get());
}

void VmRobot::SaveAndRestore(int module) {
  Node& node = nodes_[Index(module)];
  const auto* bytes = reinterpret_cast<const uint8_t*>(node.state.get());
  const std::vector<uint8_t> saved(bytes, bytes + sizeof(vm::VmState));
  node.state = std::make_unique<vm::VmState>();
  std::copy(saved.begin(), saved.end(), reinterpret_cast<uint8_t*>(node.state.get()));
  node.vm = std::make_unique<vm::Vm>(node.config, *node.kinematics, *program_, node.state.get(),
                                     vm::Vm::Start::kResume);
}

void VmRobot::ReplaceProgram(int module, const std::vector<uint8_t>& program) {
  nodes_[Index(module)].vm->ReplaceProgram(*Load(program));
}

int VmRobot::CountFaults(vm::FaultCode code) const {
  return static_cast<int>(std::count_if(faults_.begin(), faults_.end(), [code](const auto& event) {
    return event.fault.code == code;
  }));
}

}  // namespace morphbus::test
