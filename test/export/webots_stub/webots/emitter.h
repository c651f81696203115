/* The prototypes of Webots' <webots/emitter.h> that the wrapper uses, for tests without Webots. */
#ifndef WEBOTS_STUB_EMITTER_H
#define WEBOTS_STUB_EMITTER_H

#include <webots/types.h>

#ifdef __cplusplus
extern "C" {
#endif

int wb_emitter_send(WbDeviceTag tag, const void* data, int size);

#ifdef __cplusplus
}
#endif

#endif
