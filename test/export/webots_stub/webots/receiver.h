/* The prototypes of Webots' <webots/receiver.h> that the wrapper uses, for tests without Webots. */
#ifndef WEBOTS_STUB_RECEIVER_H
#define WEBOTS_STUB_RECEIVER_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

void wb_receiver_enable(WbDeviceTag tag, int sampling_period);
int wb_receiver_get_queue_length(WbDeviceTag tag);
int wb_receiver_get_data_size(WbDeviceTag tag);
const void* wb_receiver_get_data(WbDeviceTag tag);
const double* wb_receiver_get_emitter_direction(WbDeviceTag tag);
void wb_receiver_next_packet(WbDeviceTag tag);

#ifdef __cplusplus
}
#endif

#endif
