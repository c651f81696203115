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

typedef struct morphbus_link {
  const MORPHBUS_FLASH char* name;
} morphbus_link;

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
  uint8_t kind; /* enum morphbus_joint_kind */
  uint8_t link_a, link_b;
  float origin[3], axis[3];
  float lower, upper; /* rad or m; the largest float, with its sign, where there is no limit */
  float speed;        /* rad/s or m/s */
} morphbus_joint;

/* Something about a connector that the hardware can change at run time, such as hooks. */
typedef struct morphbus_state {
  const MORPHBUS_FLASH char* name;
  uint8_t num_values; /* 2 for true and false */
} morphbus_state;

typedef struct morphbus_connector {
  const MORPHBUS_FLASH char* name;
  uint8_t link, num_states, num_points;
  float centre[3]; /* in the module frame */
  const MORPHBUS_FLASH morphbus_state* states;
  const MORPHBUS_FLASH float (*points)[3]; /* its sub-points, in the module frame */
} morphbus_connector;

/* A numbered connection seen from this module. */
typedef struct morphbus_connection {
  uint8_t connection_type; /* which `connection` of the model, from 0 */
  uint8_t is_member_b;     /* 1: this module is the connection's second member */
  uint16_t number;
  uint8_t connector, mate_connector;
  float p[3], q[4]; /* of the mate's module frame in ours, joints at 0; the quaternion w x y z */
} morphbus_connection;

typedef struct morphbus_kinematics {
  const MORPHBUS_FLASH char* type_name;
  uint64_t hash;       /* of the kinematics image with the same content */
  uint64_t model_hash; /* of the model both come from */
  uint8_t num_links, num_joints, num_connectors;
  uint16_t num_connections;
  const MORPHBUS_FLASH morphbus_link* links;
  const MORPHBUS_FLASH morphbus_joint* joints;
  const MORPHBUS_FLASH morphbus_connector* connectors;
  /* By connector, type, is_member_b and number, no two alike. */
  const MORPHBUS_FLASH morphbus_connection* connections;
} morphbus_kinematics;

#endif
