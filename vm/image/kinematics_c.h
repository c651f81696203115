/* The kinematics of one module type as C constants, as "morphbus export --to c --module" prints
   them: what a kinematics image holds as bytes, for a microcontroller that keeps it in its program.
   C99 and C++. SI and radians; poses take a frame's coordinates to another's: p_M = R p_N + p. */
#ifndef MORPHBUS_KINEMATICS_C_H
#define MORPHBUS_KINEMATICS_C_H

#include <stdint.h>

/* Where the tables lie. On an AVR, whose constants take up RAM otherwise: -DMORPHBUS_FLASH=__flash
   for all C sources (GNU C; C++ has no such pointers). */
#ifndef MORPHBUS_FLASH
#define MORPHBUS_FLASH
#endif

/* A rigid part of the module. Names here are as in the model, and end with a zero byte. */
typedef struct morphbus_link {
  const MORPHBUS_FLASH char* name;
} morphbus_link;

/* How a joint moves; a continuous joint turns without limits. */
enum morphbus_joint_kind {
  MORPHBUS_REVOLUTE = 0,
  MORPHBUS_CONTINUOUS = 1,
  MORPHBUS_PRISMATIC = 2,
  MORPHBUS_FIXED = 3
};

/* +q turns (or slides) link_a relative to link_b about (along) the axis, which is a unit vector
   through the origin, both in the module frame. */
typedef struct morphbus_joint {
  const MORPHBUS_FLASH char* name;
  /* One of enum morphbus_joint_kind. */
  uint8_t kind;
  /* The links that it joins, by index. */
  uint8_t link_a, link_b;
  /* A point on the axis (m) and its unit direction. */
  float origin[3], axis[3];
  /* The limits (rad or m); the largest float, with its sign, where there is none. */
  float lower, upper;
  /* The greatest speed (rad/s or m/s). */
  float speed;
} morphbus_joint;

/* Something about a connector that the hardware can change at run time, such as hooks. */
typedef struct morphbus_state {
  const MORPHBUS_FLASH char* name;
  /* The number of values that it can take: 2 for true and false. */
  uint8_t num_values;
} morphbus_state;

/* A place at which another module can dock. */
typedef struct morphbus_connector {
  const MORPHBUS_FLASH char* name;
  /* The link that carries it, by index, and the lengths of the two tables below. */
  uint8_t link, num_states, num_points;
  /* Its centre in the module frame (m). */
  float centre[3];
  /* What its hardware can change. */
  const MORPHBUS_FLASH morphbus_state* states;
  /* Its sub-points in the module frame (m). */
  const MORPHBUS_FLASH float (*points)[3];
} morphbus_connector;

/* A numbered connection seen from this module. */
typedef struct morphbus_connection {
  /* The index of the `connection` in the model, from 0. */
  uint8_t connection_type;
  /* 1 if this module is the connection's second member, else 0. */
  uint8_t is_member_b;
  /* The number of the option within the connection, from 1. */
  uint16_t number;
  /* Our connector and the mate's, by index. */
  uint8_t connector, mate_connector;
  /* The pose of the mate's module frame in ours with all joints at 0: the position (m) and the unit
     quaternion in the order w x y z. */
  float p[3], q[4];
} morphbus_connection;

/* What a sensor measures. */
enum morphbus_sensor_kind { MORPHBUS_DISTANCE = 0, MORPHBUS_CONTACT = 1, MORPHBUS_TILT = 2 };

/* A sensor, rigid with a link. */
typedef struct morphbus_sensor {
  const MORPHBUS_FLASH char* name;
  /* One of enum morphbus_sensor_kind, and the link that carries it, by index. */
  uint8_t kind, link;
  /* Where it sits in the module frame (m), and the unit direction in which it looks. */
  float origin[3], direction[3];
  /* How far it sees (m). */
  float range;
} morphbus_sensor;

/* The kinematics of one module type: the root of all tables. */
typedef struct morphbus_kinematics {
  const MORPHBUS_FLASH char* type_name;
  /* The hash of the kinematics image with the same content. */
  uint64_t hash;
  /* The hash of the model that both come from. */
  uint64_t model_hash;
  /* The lengths of the tables below. */
  uint8_t num_links, num_joints, num_connectors;
  uint16_t num_connections;
  const MORPHBUS_FLASH morphbus_link* links;
  const MORPHBUS_FLASH morphbus_joint* joints;
  const MORPHBUS_FLASH morphbus_connector* connectors;
  /* Sorted by connector, type, is_member_b and number, no two alike. */
  const MORPHBUS_FLASH morphbus_connection* connections;
  /* The sensors; both may be left out of an initialiser where there are none. */
  uint8_t num_sensors;
  const MORPHBUS_FLASH morphbus_sensor* sensors;
} morphbus_kinematics;

#endif
