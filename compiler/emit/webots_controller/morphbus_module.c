/* See morphbus_module.h. Written by morphbus export, not by hand. */
#include "morphbus_module.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <webots/accelerometer.h>
#include <webots/connector.h>
#include <webots/distance_sensor.h>
#include <webots/emitter.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/receiver.h>
#include <webots/robot.h>
#include <webots/touch_sensor.h>

/* A packet begins with who sends it: module id (2 bytes, low first), module type (2 bytes),
   connector, whether that holds its mate. A connector sends one each period. */
enum { HEADER = 6 };

/* Of the cosine between where a mate's emitter is and where a way of docking has it. */
#define LEAST_AGREEMENT 0.9

static double sensor_values[NUM_SENSOR_VALUES + 1];

/* A part of the module: what the table of its type says, then what is known of it. Each list ends
   with a part that is none: C has no empty arrays. */
enum joint_kind { TURNS, SLIDES, FIXED };
static struct joint {
  const char *name, *sensor_name;
  enum joint_kind kind; /* A fixed one has no devices. */
  double greatest_speed;
  WbDeviceTag motor, sensor;
  double position, velocity;
  enum module_mode mode;
} joints[] = {
/* The first MODULE_HOLD then holds. */
#define JOINT(called, moves, most) \
  {.name = #called, .sensor_name = #called ".sensor", .kind = moves, .greatest_speed = most, .mode = MODULE_VELOCITY},
#include "morphbus_module.def"
    {.kind = FIXED}};

enum sensor_kind { MEASURES_DISTANCE, FEELS, MEASURES_UP };
static struct sensor {
  const char *name;
  enum sensor_kind kind;
  double range; /* The most that one of distance reads. */
  double *values;
  WbDeviceTag device;
} sensors[] = {
#define SENSOR(called, measures, num_values, most) \
  {.name = #called ".sensor", .kind = measures, .range = most, .values = &sensor_values[SENSOR_##called]},
#include "morphbus_module.def"
    {.kind = FEELS}};
enum { NUM_SENSORS = sizeof sensors / sizeof sensors[0] - 1 };

enum {
#define MODULE(type, most_states) MODULE_TYPE = type, MAX_STATES = most_states
#include "morphbus_module.def"
};
struct message {
  int size; /* 0: none */
  unsigned char bytes[HEADER + MODULE_MAX_MESSAGE];
};
static struct connector {
  const char *name, *emitter_name, *receiver_name;
  WbDeviceTag device, emitter, receiver;
  int states[MAX_STATES]; /* -1: not known */
  int sees_mate;
  struct module_reading reading;
  struct message inbox, outbox;
} connectors[] = {
#define CONNECTOR(called) \
  {.name = #called, .emitter_name = #called ".emitter", .receiver_name = #called ".receiver"},
#include "morphbus_module.def"
    {.name = 0}};

/* A setting of a connector's states, in which it locks; -1: any value. The first of a connector is
   the one in which it is docked at the start. */
static const struct lock_setting {
  int connector, values[MAX_STATES];
} lock_settings[] = {
#define LOCK(connector, ...) {CONNECTOR_##connector, {__VA_ARGS__}},
#include "morphbus_module.def"
    {-1, {-1}}};

/* A way to dock, as this module sees it; `direction` is where the mate's emitter then is, in the
   frame of the connector. The emitter is off the connector's centre: so it tells how the mate is
   turned. */
static const struct way {
  int connector, mate_type, mate_connector, connection_type, number, is_member_b;
  double direction[3];
} ways[] = {
#define WAY(connector, ...) {CONNECTOR_##connector, __VA_ARGS__},
#include "morphbus_module.def"
    {-1, 0, 0, 0, 0, 0, {0, 0, 0}}};

static int time_step, num_steps;
static int id = -1, root_link = -1;
static double root_pose[7];

/* "id 3", and for the root "id 1 root 0" and the seven numbers of the pose. */
static void read_custom_data(void) {
  const char *text = wb_robot_get_custom_data();
  char *end;
  int k;
  if (strncmp(text, "id ", 3) != 0) return;
  id = (int)strtol(text + 3, &end, 10);
  if (strncmp(end, " root ", 6) != 0) return;
  root_link = (int)strtol(end + 6, &end, 10);
  for (k = 0; k < 7; ++k) root_pose[k] = strtod(end, &end);
}

/* What it sends then looks like the echo of any other module without an id. */
static void warn_of_missing_id(void) {
  if (id >= 0) return;
  fprintf(stderr,
          "%s: warning: this module has no id, so it and others without one do not sense each other; write "
          "customData \"id N\" into its Robot node, with a number N from 0 to 65534 that no other module has\n",
          wb_robot_get_name());
}

static int holds(int connector) {
  const WbDeviceTag device = connectors[connector].device;
  return wb_connector_is_locked(device) != 0 && wb_connector_get_presence(device) == 1;
}

static void start_joint(struct joint *joint) {
  if (joint->kind == FIXED) return;
  joint->motor = wb_robot_get_device(joint->name);
  joint->sensor = wb_robot_get_device(joint->sensor_name);
  wb_position_sensor_enable(joint->sensor, time_step);
  if (joint->kind == SLIDES) {
    wb_motor_enable_force_feedback(joint->motor, time_step);
  } else {
    wb_motor_enable_torque_feedback(joint->motor, time_step);
  }
}

static void start_sensor(struct sensor *sensor) {
  sensor->device = wb_robot_get_device(sensor->name);
  if (sensor->kind == MEASURES_DISTANCE) {
    wb_distance_sensor_enable(sensor->device, time_step);
  } else if (sensor->kind == FEELS) {
    wb_touch_sensor_enable(sensor->device, time_step);
  } else {
    wb_accelerometer_enable(sensor->device, time_step);
  }
}

static void start_connector(int i) {
  struct connector *connector = &connectors[i];
  const struct lock_setting *setting = lock_settings;
  int s;
  connector->device = wb_robot_get_device(connector->name);
  connector->emitter = wb_robot_get_device(connector->emitter_name);
  connector->receiver = wb_robot_get_device(connector->receiver_name);
  wb_connector_enable_presence(connector->device, time_step);
  wb_receiver_enable(connector->receiver, time_step);
  for (s = 0; s < MAX_STATES; ++s) connector->states[s] = -1;
  if (!wb_connector_is_locked(connector->device)) return;
  while (setting->connector >= 0 && setting->connector != i) ++setting;
  if (setting->connector == i) memcpy(connector->states, setting->values, sizeof connector->states);
}

void module_start(int period_ms) {
  int i;
  wb_robot_init();
  time_step = period_ms > 0 ? period_ms : (int)wb_robot_get_basic_time_step();
  read_custom_data();
  warn_of_missing_id();
  for (i = 0; i < NUM_JOINTS; ++i) start_joint(&joints[i]);
  for (i = 0; i < NUM_SENSORS; ++i) start_sensor(&sensors[i]);
  for (i = 0; i < NUM_CONNECTORS; ++i) start_connector(i);
}

/* Is this setting, which is of this connector, the case? */
static int is_set(const struct lock_setting *setting) {
  int s;
  for (s = 0; s < MAX_STATES; ++s) {
    if (setting->values[s] >= 0 && setting->values[s] != connectors[setting->connector].states[s]) return 0;
  }
  return 1;
}

static void send_packet(int connector) {
  struct message *message = &connectors[connector].outbox;
  unsigned char *bytes = message->bytes;
  bytes[0] = (unsigned char)(id & 255);
  bytes[1] = (unsigned char)(id >> 8 & 255);
  bytes[2] = (unsigned char)(MODULE_TYPE & 255);
  bytes[3] = (unsigned char)(MODULE_TYPE >> 8 & 255);
  bytes[4] = (unsigned char)connector;
  bytes[5] = (unsigned char)holds(connector);
  wb_emitter_send(connectors[connector].emitter, bytes, HEADER + message->size);
  message->size = 0;
}

/* The way of docking that fits best what is heard; the last of the list, which is none, if none does. */
static const struct way *find_way(int connector, const unsigned char *header, const double *direction) {
  const int mate_type = header[2] + 256 * header[3];
  const struct way *way = ways, *best;
  double most = LEAST_AGREEMENT;
  for (best = 0; way->connector >= 0; ++way) {
    const double agreement = way->direction[0] * direction[0] + way->direction[1] * direction[1] +
                             way->direction[2] * direction[2];
    if (way->connector != connector || way->mate_type != mate_type || way->mate_connector != header[4] ||
        agreement <= most)
      continue;
    best = way;
    most = agreement;
  }
  return best ? best : way;
}

/* Takes over what a mate says of itself. */
static void take_packet(int i, const unsigned char *packet, int size) {
  struct connector *connector = &connectors[i];
  struct module_reading *reading = &connector->reading;
  const struct way *way;
  connector->sees_mate = 1;
  if (!packet[5] && !holds(i)) return;
  way = find_way(i, packet, wb_receiver_get_emitter_direction(connector->receiver));
  /* A neighbour that only stands near does not take the place of the mate. */
  if (reading->docked && way->connector < 0) return;
  reading->docked = 1;
  reading->mate_module = packet[0] + 256 * packet[1];
  reading->mate_connector = packet[4];
  reading->connection_type = way->connection_type;
  reading->number = way->number;
  reading->is_member_b = way->is_member_b;
  connector->inbox.size = size - HEADER;
  memcpy(connector->inbox.bytes, packet + HEADER, (size_t)(size - HEADER));
}

static void listen(int i) {
  struct connector *connector = &connectors[i];
  const WbDeviceTag receiver = connector->receiver;
  memset(&connector->reading, 0, sizeof connector->reading);
  connector->sees_mate = 0;
  connector->inbox.size = 0;
  for (; wb_receiver_get_queue_length(receiver) > 0; wb_receiver_next_packet(receiver)) {
    const unsigned char *packet = (const unsigned char *)wb_receiver_get_data(receiver);
    const int size = wb_receiver_get_data_size(receiver);
    /* Docked faces coincide, so a module hears itself too. */
    if (size >= HEADER && size <= HEADER + MODULE_MAX_MESSAGE && packet[0] + 256 * packet[1] != (id & 65535))
      take_packet(i, packet, size);
  }
}

static void read_joint(struct joint *joint) {
  double position;
  if (joint->kind == FIXED) return;
  position = wb_position_sensor_get_value(joint->sensor);
  /* Sensors have values from the first step on. */
  if (num_steps > 1) joint->velocity = (position - joint->position) * 1000 / time_step;
  joint->position = position;
}

static void read_sensor(const struct sensor *sensor) {
  if (sensor->kind == MEASURES_DISTANCE) {
    /* Noise may take it beyond what can be. */
    sensor->values[0] = fmin(fmax(wb_distance_sensor_get_value(sensor->device), 0), sensor->range);
  } else if (sensor->kind == FEELS) {
    sensor->values[0] = wb_touch_sensor_get_value(sensor->device) > 0;
  } else {
    /* At rest the acceleration that is felt is that of the ground against gravity. */
    const double *a = wb_accelerometer_get_values(sensor->device);
    const double length = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    int k;
    for (k = 0; k < 3; ++k) sensor->values[k] = length > 0 ? a[k] / length : 0;
  }
}

int module_step(void) {
  int i;
  for (i = 0; i < NUM_CONNECTORS; ++i) send_packet(i);
  if (wb_robot_step(time_step) == -1) {
    wb_robot_cleanup();
    return 0;
  }
  ++num_steps;
  for (i = 0; i < NUM_JOINTS; ++i) read_joint(&joints[i]);
  for (i = 0; i < NUM_SENSORS; ++i) read_sensor(&sensors[i]);
  for (i = 0; i < NUM_CONNECTORS; ++i) listen(i);
  return 1;
}

const char *module_name(void) { return wb_robot_get_name(); }

int module_id(void) { return id; }

int module_is_root(int *link, double pose[7]) {
  if (root_link < 0) return 0;
  if (link) *link = root_link;
  if (pose) memcpy(pose, root_pose, sizeof root_pose);
  return 1;
}

double module_time(void) { return wb_robot_get_time(); }

int64_t module_time_us(void) { return (int64_t)(wb_robot_get_time() * 1e6 + 0.5); }

double module_joint(int joint) { return joints[joint].position; }

double module_joint_velocity(int joint) { return joints[joint].velocity; }

double module_joint_effort(int i) {
  const struct joint *joint = &joints[i];
  /* Sensors have values from the first step on. */
  if (joint->kind == FIXED || num_steps == 0) return 0;
  return joint->kind == SLIDES ? wb_motor_get_force_feedback(joint->motor)
                               : wb_motor_get_torque_feedback(joint->motor);
}

double module_sensor(int value) { return sensor_values[value]; }

void module_command_joint(int i, enum module_mode mode, double target, double speed) {
  struct joint *joint = &joints[i];
  const double greatest = joint->greatest_speed;
  const int held = mode == MODULE_HOLD && joint->mode == MODULE_HOLD;
  joint->mode = mode;
  if (joint->kind == FIXED || held) return;
  if (mode == MODULE_VELOCITY) {
    wb_motor_set_position(joint->motor, INFINITY);
    wb_motor_set_velocity(joint->motor, fmin(fmax(speed, -greatest), greatest));
    return;
  }
  wb_motor_set_velocity(joint->motor,
                        mode == MODULE_POSITION && speed > 0 ? fmin(speed, greatest) : greatest);
  wb_motor_set_position(joint->motor, mode == MODULE_POSITION ? target : joint->position);
}

void module_set_joint(int joint, double value, double speed) {
  module_command_joint(joint, MODULE_POSITION, value, speed);
}

void module_read_connector(int connector, struct module_reading *reading) {
  *reading = connectors[connector].reading;
}

int module_sees_mate(int connector) { return connectors[connector].sees_mate; }

void module_set_lock(int connector, int locked) {
  if (locked) {
    wb_connector_lock(connectors[connector].device);
  } else {
    wb_connector_unlock(connectors[connector].device);
  }
}

void module_command_connector(int connector, int state, int value) {
  int asked = 0, locks = 0;
  const struct lock_setting *setting;
  if (state < 0 || state >= MAX_STATES) return;
  connectors[connector].states[state] = value;
  for (setting = lock_settings; setting->connector >= 0; ++setting) {
    if (setting->connector != connector) continue;
    asked = 1;
    locks = locks || is_set(setting);
  }
  if (asked) module_set_lock(connector, locks);
}

int module_send(int connector, const void *bytes, int size) {
  if (size < 0 || size > MODULE_MAX_MESSAGE) return 0;
  memcpy(connectors[connector].outbox.bytes + HEADER, bytes, (size_t)size);
  connectors[connector].outbox.size = size;
  return 1;
}

int module_receive(int connector, void *bytes, int capacity) {
  struct message *message = &connectors[connector].inbox;
  const int size = message->size < capacity ? message->size : capacity;
  if (message->size == 0) return -1;
  memcpy(bytes, message->bytes, (size_t)size);
  message->size = 0;
  return size;
}
