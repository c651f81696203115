/* The prototypes of Webots' <webots/touch_sensor.h> that the wrapper uses, for tests without
 * Webots. */
#ifndef WEBOTS_STUB_TOUCH_SENSOR_H
#define WEBOTS_STUB_TOUCH_SENSOR_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

void wb_touch_sensor_enable(WbDeviceTag tag, int sampling_period);
double wb_touch_sensor_get_value(WbDeviceTag tag);

#ifdef __cplusplus
}
#endif

#endif
