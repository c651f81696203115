#pragma once
// Turns untrusted bytes into VerifiedKinematics, once, in linear time.

#include <cstdint>

#include "vm/image/kinematics_image.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// Checks everything in the image (sizes, indices, names, finite numbers, unit axes and
/// quaternions, hash) and fills `out`, which then refers to `bytes`. On error `out` is left empty,
/// and the error names the byte.
VerifyError VerifyKinematics(const uint8_t* bytes, uint32_t size, VerifiedKinematics* out);

}  // namespace morphbus::vm
