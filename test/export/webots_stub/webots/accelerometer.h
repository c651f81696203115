/* The prototypes of Webots' <webots/accelerometer.h> that the wrapper uses, for tests without
 * Webots. */
#ifndef WEBOTS_STUB_ACCELEROMETER_H
#define WEBOTS_STUB_ACCELEROMETER_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

void wb_accelerometer_enable(WbDeviceTag tag, int sampling_period);
const double* wb_accelerometer_get_values(WbDeviceTag tag);

#ifdef __cplusplus
}
#endif

#endif
