#pragma once
// SENSORS as a module needs it: of all the readings in a part only its own, for a part has a dozen
// and a module hears one in every tick.

#include <cstdint>
#include <morphbus/sensors_t.hpp>

#include "bridge/wire/codec.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Decode for a part of SENSORS, with all its checks, that leaves out of `out->modules` all
/// readings but the one of this module, if it is there.
Result<void> DecodeOwnSensors(const uint8_t* data, size_t size, const Expectation& expect,
                              uint16_t module_id, morphbus::sensors_t* out);

}  // namespace morphbus::bridge
