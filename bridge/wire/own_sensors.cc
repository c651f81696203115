#include "bridge/wire/own_sensors.h"

#include <utility>

#include "bridge/wire/wire_peek.h"

namespace morphbus::bridge {

Result<void> DecodeOwnSensors(const uint8_t* data, size_t size, const Expectation& expect,
                              uint16_t module_id, morphbus::sensors_t* out) {
  if (Result<void> sound = Check<morphbus::sensors_t>(data, size, expect); !sound) return sound;
  // From here on every length in the message is known to be right.
  const uint8_t* mine = nullptr;
  const uint8_t* orders = PeekReadings(data, [&](const PeekedReading& reading) {
    if (reading.module_id == module_id) mine = reading.bytes;
  });
  const auto bytes_from = [&](const uint8_t* at) { return static_cast<int>(data + size - at); };
  // The header, the part's number and the number of parts stand before the readings.
  const int header = out->header._decodeNoHash(data, 8, static_cast<int>(size) - 8);
  out->part = PeekInteger<int16_t>(data + OffsetOf<morphbus::sensors_t>("part"));
  out->num_parts = PeekInteger<int16_t>(data + OffsetOf<morphbus::sensors_t>("num_parts"));
  out->modules.resize(mine == nullptr ? 0 : 1);
  out->num_modules = static_cast<int16_t>(out->modules.size());
  if (header < 0 ||
      (mine != nullptr && out->modules[0]._decodeNoHash(mine, 0, bytes_from(mine)) < 0)) {
    return Fail("the message's size does not fit its lengths");
  }
  // Orders are rare: four lists, each mostly nothing but its length.
  out->num_requests = out->num_pieces = out->num_root_poses = out->num_inspected = 0;
  out->requests.clear();
  out->pieces.clear();
  out->root_poses.clear();
  out->inspected.clear();
  if (orders[0] == 0 && orders[1] == 0 && orders[2] == 0 && orders[3] == 0) return {};
  morphbus::sensors_t all;
  if (all.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) {
    return Fail("the message's size does not fit its lengths");
  }
  // What is ours stays, the other readings do not.
  std::swap(all.modules, out->modules);
  all.num_modules = out->num_modules;
  *out = std::move(all);
  return {};
}

}  // namespace morphbus::bridge
