/* A Webots of one M-TRAN module for the wrapper's tests: motors reach their target at once, what is sent
   comes back as the module's own echo and then as if module 7 had sent it from its c3, which holds. Prints
   what it is asked to do. The environment's CUSTOM_DATA takes the place of the module's own, STEPS of the
   5 steps that the simulation takes, and DISTANCE of the 0.125 m that is seen. Something always touches. */
#include <webots/accelerometer.h>
#include <webots/distance_sensor.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <webots/connector.h>
#include <webots/emitter.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/receiver.h>
#include <webots/robot.h>
#include <webots/touch_sensor.h>

static char names[64][64];
static int num_names, steps;
static int queued[64];
static double positions[64];
static char packets[64][2][8192];
static int sizes[64];
static char locked[64];

static WbDeviceTag find(const char *name) {
  int i;
  for (i = 0; i < num_names; ++i)
    if (strcmp(names[i], name) == 0) return (WbDeviceTag)(i + 1);
  return 0;
}

int wb_robot_init() { return 1; }
int wb_robot_step(int duration) {
  const char *most = getenv("STEPS");
  steps += 1;
  return steps > (most ? atoi(most) : 5) ? -1 : duration * 0;
}
void wb_robot_cleanup() { printf("cleanup\n"); }
double wb_robot_get_time() { return 0.004 * steps; }
double wb_robot_get_basic_time_step() { return 4; }
const char *wb_robot_get_name() { return "m1"; }
const char *wb_robot_get_custom_data() {
  const char *given = getenv("CUSTOM_DATA");
  return given ? given : "id 3 root 1 0.5 -0.25 0 0.5 0.5 -0.5 0.5";
}
WbDeviceTag wb_robot_get_device(const char *name) {
  printf("device %s\n", name);
  if (!find(name)) strcpy(names[num_names++], name);
  return find(name);
}
void wb_motor_set_position(WbDeviceTag tag, double position) {
  char sensor[80];
  printf("position %s %g\n", names[tag - 1], position);
  sprintf(sensor, "%s.sensor", names[tag - 1]);
  positions[find(sensor)] = position;
}
void wb_motor_set_velocity(WbDeviceTag tag, double velocity) {
  printf("velocity %s %.4f\n", names[tag - 1], velocity);
}
/* All joints turn: a force would be a mistake. */
static int feeds_back[64];
void wb_motor_enable_torque_feedback(WbDeviceTag tag, int period) { (void)period, feeds_back[tag] = 1; }
double wb_motor_get_torque_feedback(WbDeviceTag tag) { return feeds_back[tag] ? -0.5 : 0; }
void wb_motor_enable_force_feedback(WbDeviceTag tag, int period) { (void)tag, (void)period, abort(); }
double wb_motor_get_force_feedback(WbDeviceTag tag) { return (void)tag, abort(), 0; }
void wb_position_sensor_enable(WbDeviceTag tag, int period) {
  positions[tag] = 0.25;
  (void)period;
}
double wb_position_sensor_get_value(WbDeviceTag tag) { return positions[tag]; }
void wb_distance_sensor_enable(WbDeviceTag tag, int period) { (void)tag, (void)period; }
double wb_distance_sensor_get_value(WbDeviceTag tag) {
  const char *given = getenv("DISTANCE");
  return (void)tag, given ? atof(given) : 0.125;
}
void wb_touch_sensor_enable(WbDeviceTag tag, int period) { (void)tag, (void)period; }
double wb_touch_sensor_get_value(WbDeviceTag tag) { return (void)tag, 1; }
void wb_accelerometer_enable(WbDeviceTag tag, int period) { (void)tag, (void)period; }
const double *wb_accelerometer_get_values(WbDeviceTag tag) {
  static const double felt[3] = {0, 3, 4};
  return (void)tag, felt;
}
void wb_connector_enable_presence(WbDeviceTag tag, int period) { (void)tag, (void)period; }
/* c4 to c6 are passive: they sense nothing and hold nothing. */
static int is_passive(WbDeviceTag tag) { return names[tag - 1][1] >= '4'; }
int wb_connector_get_presence(WbDeviceTag tag) { return is_passive(tag) ? -1 : 1; }
void wb_connector_lock(WbDeviceTag tag) {
  printf("lock %s\n", names[tag - 1]);
  locked[tag] = !is_passive(tag);
}
void wb_connector_unlock(WbDeviceTag tag) {
  printf("unlock %s\n", names[tag - 1]);
  locked[tag] = 0;
}
bool wb_connector_is_locked(WbDeviceTag tag) { return locked[tag]; }
int wb_emitter_send(WbDeviceTag tag, const void *data, int size) {
  /* Emitter c1.emitter sends to c1.receiver. */
  char receiver[80];
  WbDeviceTag to;
  printf("send %s %d\n", names[tag - 1], size);
  sprintf(receiver, "%.2s.receiver", names[tag - 1]);
  to = find(receiver);
  memcpy(packets[to][0], data, (size_t)size);
  memcpy(packets[to][1], data, (size_t)size);
  packets[to][1][0] = 7;
  packets[to][1][4] = 2;
  packets[to][1][5] = 1;
  sizes[to] = size;
  queued[to] = 2;
  return 1;
}
void wb_receiver_enable(WbDeviceTag tag, int period) { (void)tag, (void)period; }
int wb_receiver_get_queue_length(WbDeviceTag tag) { return queued[tag]; }
int wb_receiver_get_data_size(WbDeviceTag tag) { return sizes[tag]; }
const void *wb_receiver_get_data(WbDeviceTag tag) { return packets[tag][2 - queued[tag]]; }
const double *wb_receiver_get_emitter_direction(WbDeviceTag tag) {
  static const double up[3] = {0, 0, 1};
  return (void)tag, up;
}
void wb_receiver_next_packet(WbDeviceTag tag) { --queued[tag]; }
