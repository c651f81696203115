/* The prototypes of Webots' <webots/robot.h> that the wrapper uses, for tests without Webots. */
#ifndef WEBOTS_STUB_ROBOT_H
#define WEBOTS_STUB_ROBOT_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

int wb_robot_init();
int wb_robot_step(int duration);
void wb_robot_cleanup();
double wb_robot_get_time();
double wb_robot_get_basic_time_step();
const char* wb_robot_get_name();
const char* wb_robot_get_custom_data();
WbDeviceTag wb_robot_get_device(const char* name);

#ifdef __cplusplus
}
#endif

#endif
