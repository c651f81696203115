#pragma once
// Why an image is refused, where there is room for sentences.

#include "vm/limits.h"

namespace morphbus::vm {

/// A microcontroller says only where: the same image refused on a host says why, and sentences take
/// flash.
constexpr const char* Reason(const char* text) { return kSmallProfile ? "refused" : text; }

}  // namespace morphbus::vm
