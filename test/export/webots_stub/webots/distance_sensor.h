/* The prototypes of Webots' <webots/distance_sensor.h> that the wrapper uses, for tests without
 * Webots. */
#ifndef WEBOTS_STUB_DISTANCE_SENSOR_H
#define WEBOTS_STUB_DISTANCE_SENSOR_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

void wb_distance_sensor_enable(WbDeviceTag tag, int sampling_period);
double wb_distance_sensor_get_value(WbDeviceTag tag);

#ifdef __cplusplus
}
#endif

#endif
