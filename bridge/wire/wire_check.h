#pragma once
// Walks the bytes of a message as lcm-gen lays them out, and refuses whatever the generated decoder
// would choke on or a receiver must not believe: lengths beyond capacities, text without its NUL or
// with one inside, numbers that are not finite, ids out of range, trailing bytes. Allocates
// nothing.

#include <cstddef>
#include <cstdint>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Checks one message of type M, fingerprint included. Instantiated for the top-level types only.
template <class M>
Result<void> CheckWire(const uint8_t* data, size_t size);

}  // namespace morphbus::bridge
