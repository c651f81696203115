// The controller that the modules of a Webots world run: C99, by names of the model.

#include <fmt/format.h>

#include <algorithm>

#include "compiler/emit/webots.h"

namespace morphbus::emit {
namespace {

constexpr const char* kHeader =
    R"(/* Module type @TYPE@ in Webots: its joints and connectors by number. Written by morphbus export, not by
   hand. SI, radians; joint values are those of the model. */
#ifndef MORPHBUS_MODULE_H
#define MORPHBUS_MODULE_H

enum { @JOINTS@NUM_JOINTS = @NUM_JOINTS@ };
enum { @CONNECTORS@NUM_CONNECTORS = @NUM_CONNECTORS@ };

/* Longest message over a connector, in bytes. */
#define MODULE_MAX_MESSAGE 1024

/* Finds the devices; call it first. */
void module_start(void);
/* Lets the simulation go on for a step; 0 when it ends, and then clean up is done. */
int module_step(void);

/* The module's name, as in the model. */
const char *module_name(void);
/* Simulation time, s. */
double module_time(void);

/* Measured value of a joint (rad, m). */
double module_joint(int joint);
/* Sends a joint to a value (rad, m), no faster than speed (rad/s, m/s; 0: its greatest). */
void module_set_joint(int joint, double value, double speed);

/* Whether another module's connector is there to be locked to. */
int module_sees_mate(int connector);
int module_is_locked(int connector);
void module_set_lock(int connector, int locked);

/* Sends to the module docked there; whether it fitted. */
int module_send(int connector, const void *bytes, int size);
/* Takes the next message that came in there: its size, cut to capacity; -1 if there is none. */
int module_receive(int connector, void *bytes, int capacity);

#endif
)";

constexpr const char* kSource =
    R"(/* See morphbus_module.h. Written by morphbus export, not by hand. */
#include "morphbus_module.h"

#include <string.h>
#include <webots/connector.h>
#include <webots/emitter.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/receiver.h>
#include <webots/robot.h>

#define MAX_NAME 64

/* One more than there are: C has no empty arrays. */
static const char *const joint_names[NUM_JOINTS + 1] = {@JOINT_NAMES@0};
static const char *const sensor_names[NUM_JOINTS + 1] = {@SENSOR_NAMES@0};
static const double greatest_speed[NUM_JOINTS + 1] = {@SPEEDS@0};
static const char *const connector_names[NUM_CONNECTORS + 1] = {@CONNECTOR_NAMES@0};
static const char *const emitter_names[NUM_CONNECTORS + 1] = {@EMITTER_NAMES@0};
static const char *const receiver_names[NUM_CONNECTORS + 1] = {@RECEIVER_NAMES@0};

static WbDeviceTag motors[NUM_JOINTS + 1], sensors[NUM_JOINTS + 1];
static WbDeviceTag connectors[NUM_CONNECTORS + 1], emitters[NUM_CONNECTORS + 1],
    receivers[NUM_CONNECTORS + 1];
static int time_step;

void module_start(void) {
  int i;
  wb_robot_init();
  time_step = (int)wb_robot_get_basic_time_step();
  for (i = 0; i < NUM_JOINTS; ++i) {
    motors[i] = wb_robot_get_device(joint_names[i]);
    sensors[i] = wb_robot_get_device(sensor_names[i]);
    wb_position_sensor_enable(sensors[i], time_step);
  }
  for (i = 0; i < NUM_CONNECTORS; ++i) {
    connectors[i] = wb_robot_get_device(connector_names[i]);
    emitters[i] = wb_robot_get_device(emitter_names[i]);
    receivers[i] = wb_robot_get_device(receiver_names[i]);
    wb_connector_enable_presence(connectors[i], time_step);
    wb_receiver_enable(receivers[i], time_step);
  }
}

int module_step(void) {
  if (wb_robot_step(time_step) != -1) return 1;
  wb_robot_cleanup();
  return 0;
}

const char *module_name(void) { return wb_robot_get_name(); }

double module_time(void) { return wb_robot_get_time(); }

double module_joint(int joint) { return wb_position_sensor_get_value(sensors[joint]); }

void module_set_joint(int joint, double value, double speed) {
  const double greatest = greatest_speed[joint];
  wb_motor_set_velocity(motors[joint], speed > 0 && speed < greatest ? speed : greatest);
  wb_motor_set_position(motors[joint], value);
}

int module_sees_mate(int connector) { return wb_connector_get_presence(connectors[connector]) == 1; }

int module_is_locked(int connector) { return wb_connector_is_locked(connectors[connector]) != 0; }

void module_set_lock(int connector, int locked) {
  if (locked) {
    wb_connector_lock(connectors[connector]);
  } else {
    wb_connector_unlock(connectors[connector]);
  }
}

/* Docked faces coincide, so a module may hear itself: the sender's name goes first. */
int module_send(int connector, const void *bytes, int size) {
  static char packet[MAX_NAME + MODULE_MAX_MESSAGE];
  const size_t name = strlen(wb_robot_get_name()) + 1;
  if (size < 0 || size > MODULE_MAX_MESSAGE || name > MAX_NAME) return 0;
  memcpy(packet, wb_robot_get_name(), name);
  memcpy(packet + name, bytes, (size_t)size);
  return wb_emitter_send(emitters[connector], packet, (int)name + size) == 1;
}

int module_receive(int connector, void *bytes, int capacity) {
  const WbDeviceTag receiver = receivers[connector];
  while (wb_receiver_get_queue_length(receiver) > 0) {
    const char *packet = (const char *)wb_receiver_get_data(receiver);
    const int size = wb_receiver_get_data_size(receiver);
    const char *end = (const char *)memchr(packet, 0, (size_t)size);
    int got = -1;
    if (end && strcmp(packet, wb_robot_get_name()) != 0) {
      got = size - (int)(end + 1 - packet);
      if (got > capacity) got = capacity;
      memcpy(bytes, end + 1, (size_t)got);
    }
    wb_receiver_next_packet(receiver);
    if (got >= 0) return got;
  }
  return -1;
}
)";

constexpr const char* kMain =
    R"(/* Holds each joint where it starts. Written by morphbus export: copy it before you make it your own. */
#include "morphbus_module.h"

int main(void) {
  int joint;
  module_start();
  if (!module_step()) return 0; /* Sensors have values from the first step on. */
  for (joint = 0; joint < NUM_JOINTS; ++joint) module_set_joint(joint, module_joint(joint), 0);
  while (module_step()) continue;
  return 0;
}
)";

constexpr const char* kMakefile = R"(# Built by Webots itself. Written by morphbus export.
C_SOURCES = @NAME@.c morphbus_module.c
null :=
space := $(null) $(null)
WEBOTS_HOME_PATH ?= $(subst $(space),\ ,$(strip $(subst \,/,$(WEBOTS_HOME))))
include $(WEBOTS_HOME_PATH)/resources/Makefile.include
)";

std::string Filled(std::string text,
                   const std::vector<std::pair<std::string, std::string>>& values) {
  for (const auto& [key, value] : values) {
    const std::string mark = "@" + key + "@";
    for (size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at)) {
      text.replace(at, mark.size(), value);
      at += value.size();
    }
  }
  return text;
}

/// JOINT_joint_1 = 0, …; the names keep their case, so that none clash.
template <typename T>
std::string Enumerators(const std::vector<T>& items, const std::string& prefix) {
  std::string text;
  for (size_t i = 0; i < items.size(); ++i) {
    text += fmt::format("{}_{} = {}, ", prefix, items[i].name, i);
  }
  return text;
}

template <typename T>
std::string Quoted(const std::vector<T>& items, const std::string& suffix) {
  std::string text;
  for (const T& item : items) text += fmt::format("\"{}{}\", ", item.name, suffix);
  return text;
}

}  // namespace

std::string WebotsControllerName(const model::ModuleType& type) { return "morphbus_" + type.name; }

std::vector<CompanionFile> WebotsController(const model::ModuleType& type) {
  // Fixed joints have no motor.
  std::vector<model::Joint> joints;
  std::copy_if(type.joints.begin(), type.joints.end(), std::back_inserter(joints),
               [](const model::Joint& joint) { return joint.type != model::JointType::kFixed; });
  std::string speeds;
  for (const model::Joint& joint : joints) speeds += fmt::format("{}, ", joint.speed);
  const std::vector<std::pair<std::string, std::string>> values = {
      {"TYPE", type.name},
      {"NAME", WebotsControllerName(type)},
      {"JOINTS", Enumerators(joints, "JOINT")},
      {"NUM_JOINTS", std::to_string(joints.size())},
      {"CONNECTORS", Enumerators(type.connectors, "CONNECTOR")},
      {"NUM_CONNECTORS", std::to_string(type.connectors.size())},
      {"JOINT_NAMES", Quoted(joints, "")},
      {"SENSOR_NAMES", Quoted(joints, ".sensor")},
      {"SPEEDS", speeds},
      {"CONNECTOR_NAMES", Quoted(type.connectors, "")},
      {"EMITTER_NAMES", Quoted(type.connectors, ".emitter")},
      {"RECEIVER_NAMES", Quoted(type.connectors, ".receiver")},
  };
  return {{"morphbus_module.h", Filled(kHeader, values)},
          {"morphbus_module.c", Filled(kSource, values)},
          {WebotsControllerName(type) + ".c", Filled(kMain, values)},
          {"Makefile", Filled(kMakefile, values)}};
}

}  // namespace morphbus::emit
