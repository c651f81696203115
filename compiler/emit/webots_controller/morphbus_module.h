/* What the controller of a module in Webots senses, does and hears. The same for all module types:
   what one of them is made of stands in morphbus_module.def. Written by morphbus export, not by
   hand. SI, radians; joints, connectors and states are numbered as in the model. */
#ifndef MORPHBUS_MODULE_H
#define MORPHBUS_MODULE_H

#include <stdint.h>

/* JOINT_knee and so on, by the names in the model, and how many there are. */
enum {
#define JOINT(name, kind, greatest_speed) JOINT_##name,
#include "morphbus_module.def"
  NUM_JOINTS
};
enum {
#define CONNECTOR(name) CONNECTOR_##name,
#include "morphbus_module.def"
  NUM_CONNECTORS
};
/* Where the values of each sensor begin, and how many there are in all. */
enum {
#define SENSOR(name, kind, num_values, range) \
  SENSOR_##name, LAST_OF_SENSOR_##name = SENSOR_##name + num_values - 1,
#include "morphbus_module.def"
  NUM_SENSOR_VALUES
};

/* Longest message over a connector, in bytes. */
#define MODULE_MAX_MESSAGE 4096

#ifdef __cplusplus
extern "C" {
#endif

/* Finds the devices; call it first. The controller runs every period_ms milliseconds of simulation
   time (0: the world's time step, of which it must be a multiple); modules that talk must agree on
   it. */
void module_start(int period_ms);
/* Sends what module_send left, lets the simulation go on for a period, and reads the sensors; 0
   when the simulation ends, and then clean up is done. */
int module_step(void);

/* The module's name, as in the model. */
const char* module_name(void);
/* Its number among the robot's modules, from 0; of a module that was made by hand, what the Robot
   node's customData says ("id 9"), else -1. Modules sense each other by their numbers: no two may
   have the same, and one without any, of which module_start warns, senses others without one as
   little as its own echo. */
int module_id(void);
/* Whether the module carries the robot frame; if so, the link that does and its pose in the robot
   frame: position (m), unit quaternion w x y z. Both may be null. */
int module_is_root(int* link, double pose[7]);
/* Simulation time. */
double module_time(void); /* s */
int64_t module_time_us(void);

/* Measured value of a joint (rad, m); 0 for a fixed one. */
double module_joint(int joint);
/* How fast it changed over the last period (rad/s, m/s). */
double module_joint_velocity(int joint);
/* What its motor exerts (N m, N of one that slides), by Webots' feedback. */
double module_joint_effort(int joint);
/* What the sensors measure: one value of a distance sensor (m, its range if it sees nothing), three
   of a tilt sensor (straight up in its link's frame, of length 1), one of a contact sensor (1 while
   something touches it, else 0). */
double module_sensor(int value);

enum module_mode { MODULE_HOLD, MODULE_POSITION, MODULE_VELOCITY };
/* MODULE_HOLD: keeps the joint where it is. MODULE_POSITION: to target (rad, m), no faster than
   speed (rad/s, m/s; 0: its greatest). MODULE_VELOCITY: on and on at speed, which has a sign. */
void module_command_joint(int joint, enum module_mode mode, double target, double speed);
/* The second of these. */
void module_set_joint(int joint, double value, double speed);

/* What a connector senses. */
struct module_reading {
  int docked;      /* it, or its mate, holds the other; the rest is 0 if not */
  int mate_module; /* the mate's module_id */
  int mate_connector;
  int connection_type; /* which `connection` of the model, from 0 */
  int number;      /* the connection's number for which this module is member a; 0: no such way */
  int is_member_b; /* the model has none with this module as member a: number is the mate's */
};
void module_read_connector(int connector, struct module_reading* reading);
/* Whether another module's connector is within reach, docked or not. */
int module_sees_mate(int connector);
/* Has the connector take hold of what is in reach, or let go. A passive one cannot. */
void module_set_lock(int connector, int locked);
/* Sets a state variable to one of its values (an index): takes hold when the states are those in
   which the model's connections are made, else lets go. */
void module_command_connector(int connector, int state, int value);

/* Leaves a message for the mate on a connector, which leaves with the next step; a second one takes
   the place of the first; an empty one is none. Whether it is not too long. */
int module_send(int connector, const void* bytes, int size);
/* The message of the mate that came in with the last step: its size, cut to capacity; -1 if none
 * did. */
int module_receive(int connector, void* bytes, int capacity);

#ifdef __cplusplus
}
#endif

#endif
