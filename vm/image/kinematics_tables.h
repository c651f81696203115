#pragma once
// The kinematics of a module type as tables in C (vm/image/kinematics_c.h), which "morphbus export
// --to c" prints, in place of an image.

#include "vm/image/kinematics_image.h"

namespace morphbus::vm {

/// Checks tables as VerifyKinematics checks an image, but for the hash, which stands for the
/// image's content and is believed: the tables are part of the program that holds them. `tables`
/// must outlive `out`; on error `out` is left empty, and the error's offset is the index of the
/// row.
VerifyError VerifyTables(const morphbus_kinematics& tables, VerifiedKinematics* out);

}  // namespace morphbus::vm
