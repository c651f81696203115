/* The prototypes of Webots' <webots/types.h> that the wrapper uses, for tests without Webots. */
#ifndef WEBOTS_STUB_TYPES_H
#define WEBOTS_STUB_TYPES_H

#ifndef __cplusplus
#ifndef bool
#define bool char
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

typedef unsigned short WbDeviceTag;

#ifdef __cplusplus
}
#endif

#endif
