/* The prototypes of Webots' <webots/motor.h> that the wrapper uses, for tests without Webots. */
#ifndef WEBOTS_STUB_MOTOR_H
#define WEBOTS_STUB_MOTOR_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

void wb_motor_set_position(WbDeviceTag tag, double position);
void wb_motor_set_velocity(WbDeviceTag tag, double velocity);
void wb_motor_enable_force_feedback(WbDeviceTag tag, int sampling_period);
double wb_motor_get_force_feedback(WbDeviceTag tag);
void wb_motor_enable_torque_feedback(WbDeviceTag tag, int sampling_period);
double wb_motor_get_torque_feedback(WbDeviceTag tag);

#ifdef __cplusplus
}
#endif

#endif
