#include "test/compiler/emit/fake_webots.h"

#include <fmt/format.h>
#include <webots/accelerometer.h>
#include <webots/connector.h>
#include <webots/distance_sensor.h>
#include <webots/emitter.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/receiver.h>
#include <webots/robot.h>
#include <webots/touch_sensor.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "compiler/base/check.h"
#include "compiler/emit/webots.h"
#include "compiler/model/forward_kinematics.h"

namespace morphbus::test {
namespace {

FakeWebots* the_world = nullptr;

}  // namespace

thread_local int FakeWebots::current_ = 0;

FakeWebots* FakeWebots::instance() { return the_world; }

FakeWebots::FakeWebots(const model::Model& model, const model::Robot& robot)
    : scale_(emit::DockScaleOf(model)) {
  const emit::DockFaces faces = emit::DockFacesOf(model);
  const auto X_RL = model::ForwardKinematics(model, robot, model::StartValues(robot)).X_RL;
  for (size_t m = 0; m < robot.modules.size(); ++m) {
    const model::ModuleInstance& instance = robot.modules[m];
    const auto type_index = static_cast<size_t>(instance.type);
    const model::ModuleType& type = model.module_types[type_index];
    Module module;
    module.name = instance.name;
    module.custom_data = fmt::format("id {}", m);
    if (static_cast<int>(m) == robot.root_module) {
      const model::Pose X = robot.X_LR.inverse();
      const Eigen::Vector3d p = X.translation();
      const Eigen::Quaterniond q(X.linear());
      module.custom_data += fmt::format(" root {} {} {} {} {} {} {} {}", robot.root_link, p.x(),
                                        p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
    }
    for (size_t j = 0; j < type.joints.size(); ++j) {
      module.positions[type.joints[j].name + ".sensor"] = instance.start[j];
    }
    for (size_t c = 0; c < type.connectors.size(); ++c) {
      const emit::DockFace& node = faces[type_index][c];
      const auto link = static_cast<size_t>(type.connectors[c].link);
      module.faces.push_back({type.connectors[c].name, node, X_RL[m][link] * node.X_LC, false});
    }
    module.inboxes.resize(module.faces.size());
    modules_.push_back(std::move(module));
  }
  for (const model::Docking& d : robot.dockings) {
    for (const auto& [m, c] :
         {std::pair(d.module_a, d.connector_a), std::pair(d.module_b, d.connector_b)}) {
      Face& face = modules_[static_cast<size_t>(m)].faces[static_cast<size_t>(c)];
      face.locked = face.node.type != std::string("passive");
    }
  }
  the_world = this;
}

FakeWebots::~FakeWebots() { the_world = nullptr; }

void FakeWebots::Step(int milliseconds) {
  time_ += 1e-3 * milliseconds;
  // Controllers in threads send in any order.
  std::stable_sort(sent_.begin(), sent_.end(),
                   [](const Sent& a, const Sent& b) { return a.module < b.module; });
  for (Module& module : modules_) {
    for (size_t f = 0; f < module.faces.size(); ++f) {
      module.inboxes[f].clear();
      const model::Pose X_CW = module.faces[f].X_WC.inverse();
      for (const Sent& sent : sent_) {
        const Eigen::Vector3d emitter(0.0, 0.0, scale_.emitter_offset);
        const Eigen::Vector3d way = X_CW * (modules_[sent.module].faces[sent.face].X_WC * emitter);
        if (way.norm() > scale_.reach) continue;
        module.inboxes[f].push_back({sent.bytes, way.normalized()});
      }
    }
  }
  sent_.clear();
}

void FakeWebots::Run(const std::vector<std::function<void()>>& controllers, int steps,
                     const std::function<void()>& look) {
  num_controllers_ = controllers.size();
  steps_left_ = steps;
  look_ = look;
  std::vector<std::thread> threads;
  for (size_t m = 0; m < controllers.size(); ++m) {
    threads.emplace_back([this, m, &controllers] {
      Enter(static_cast<int>(m));
      controllers[m]();
    });
  }
  for (std::thread& thread : threads) thread.join();
  num_controllers_ = 0;
}

int FakeWebots::StepOfController(int milliseconds) {
  if (num_controllers_ == 0) return 0;
  std::unique_lock lock(mutex_);
  // The last one to ask lets time go on for all.
  if (++waiting_ < num_controllers_) {
    const int step = steps_;
    stepped_.wait(lock, [&] { return steps_ != step; });
  } else {
    waiting_ = 0;
    Step(milliseconds);
    look_();
    ++steps_;
    --steps_left_;
    stepped_.notify_all();
  }
  return steps_left_ > 0 ? 0 : -1;
}

size_t FakeWebots::FaceOf(const std::string& device) {
  const std::string name = device.substr(0, device.find('.'));
  const std::vector<Face>& faces = current().faces;
  const auto found =
      std::find_if(faces.begin(), faces.end(), [&](const Face& face) { return face.name == name; });
  MORPHBUS_CHECK(found != faces.end());
  return static_cast<size_t>(found - faces.begin());
}

int FakeWebots::Presence(size_t face) {
  const Face& own = current().faces[face];
  if (own.node.type == std::string("passive")) return -1;
  for (const Module& module : modules_) {
    if (&module == &current()) continue;
    for (const Face& other : module.faces) {
      if (other.node.model == own.node.model &&
          emit::Aligned(own.X_WC, other.X_WC, own.node.rotations, scale_.tolerance)) {
        return 1;
      }
    }
  }
  return 0;
}

void FakeWebots::Send(size_t face, const void* bytes, int size) {
  const auto* data = static_cast<const unsigned char*>(bytes);
  const std::lock_guard lock(mutex_);
  sent_.push_back({static_cast<size_t>(current_), face, {data, data + size}});
}

}  // namespace morphbus::test

namespace {

using morphbus::test::FakeWebots;

FakeWebots& World() { return *FakeWebots::instance(); }
const std::string& NameOf(WbDeviceTag tag) { return World().current().devices.at(tag - 1u); }
size_t FaceOf(WbDeviceTag tag) { return World().FaceOf(NameOf(tag)); }
std::vector<FakeWebots::Packet>& Inbox(WbDeviceTag tag) {
  return World().current().inboxes[FaceOf(tag)];
}

}  // namespace

extern "C" {

int wb_robot_init() { return 1; }
int wb_robot_step(int duration) { return World().StepOfController(duration); }
void wb_robot_cleanup() {}
double wb_robot_get_time() { return World().time(); }
double wb_robot_get_basic_time_step() { return 4; }
const char* wb_robot_get_name() { return World().current().name.c_str(); }
const char* wb_robot_get_custom_data() { return World().current().custom_data.c_str(); }
WbDeviceTag wb_robot_get_device(const char* name) {
  World().current().devices.emplace_back(name);
  return static_cast<WbDeviceTag>(World().current().devices.size());
}
void wb_motor_set_position(WbDeviceTag tag, double position) {
  World().current().motors[NameOf(tag)].position = position;
  if (std::isfinite(position)) World().current().positions.at(NameOf(tag) + ".sensor") = position;
}
void wb_motor_set_velocity(WbDeviceTag tag, double velocity) {
  World().current().motors[NameOf(tag)].velocity = velocity;
}
void wb_motor_enable_torque_feedback(WbDeviceTag, int) {}
double wb_motor_get_torque_feedback(WbDeviceTag) { return 0; }
void wb_motor_enable_force_feedback(WbDeviceTag, int) {}
double wb_motor_get_force_feedback(WbDeviceTag) { return 0; }
void wb_position_sensor_enable(WbDeviceTag, int) {}
double wb_position_sensor_get_value(WbDeviceTag tag) {
  return World().current().positions.at(NameOf(tag));
}
void wb_distance_sensor_enable(WbDeviceTag, int) {}
double wb_distance_sensor_get_value(WbDeviceTag) { return 1; }
void wb_touch_sensor_enable(WbDeviceTag, int) {}
double wb_touch_sensor_get_value(WbDeviceTag) { return 0; }
void wb_accelerometer_enable(WbDeviceTag, int) {}
const double* wb_accelerometer_get_values(WbDeviceTag) {
  static const double up[3] = {0, 9.81, 0};
  return up;
}
void wb_connector_enable_presence(WbDeviceTag, int) {}
int wb_connector_get_presence(WbDeviceTag tag) { return World().Presence(FaceOf(tag)); }
void wb_connector_lock(WbDeviceTag tag) {
  FakeWebots::Face& face = World().current().faces[FaceOf(tag)];
  face.locked = face.node.type != std::string("passive");
}
void wb_connector_unlock(WbDeviceTag tag) { World().current().faces[FaceOf(tag)].locked = false; }
bool wb_connector_is_locked(WbDeviceTag tag) { return World().current().faces[FaceOf(tag)].locked; }
int wb_emitter_send(WbDeviceTag tag, const void* data, int size) {
  World().Send(FaceOf(tag), data, size);
  return 1;
}
void wb_receiver_enable(WbDeviceTag, int) {}
int wb_receiver_get_queue_length(WbDeviceTag tag) { return static_cast<int>(Inbox(tag).size()); }
int wb_receiver_get_data_size(WbDeviceTag tag) {
  return static_cast<int>(Inbox(tag).front().bytes.size());
}
const void* wb_receiver_get_data(WbDeviceTag tag) { return Inbox(tag).front().bytes.data(); }
const double* wb_receiver_get_emitter_direction(WbDeviceTag tag) {
  return Inbox(tag).front().direction.data();
}
void wb_receiver_next_packet(WbDeviceTag tag) { Inbox(tag).erase(Inbox(tag).begin()); }
}
