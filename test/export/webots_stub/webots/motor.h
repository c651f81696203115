/* The prototypes of Webots' <webots/motor.h> that the wrapper uses, for tests without Webots. */
#ifndef WEBOTS_STUB_MOTOR_H
#define WEBOTS_STUB_MOTOR_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

void wb_motor_set_position(WbDeviceTag tag, double position);
void wb_motor_set_velocity(WbDeviceTag tag, double velocity);

#ifdef __cplusplus
}
#endif

#endif
