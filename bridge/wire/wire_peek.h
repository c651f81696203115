#pragma once
// Single fields of messages, read at their places without decoding the rest: for readers of logs,
// who want one field of a million messages, and for modules, of whom each wants its own reading of
// all in SENSORS. The message must have passed CheckBody (codec.h).
// Places of fields before all arrays are looked up in the layout; those behind arrays follow from
// the order of the fields in lcmtypes/. test/bridge/codec_test.cc compares them with what the
// decoders say.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <morphbus/pose_t.hpp>
#include <string_view>
#include <type_traits>
#include <vector>

#include "bridge/wire/wire_size.h"
#include "compiler/base/big_endian.h"

namespace morphbus::bridge {

/// An integer in network order.
template <class Integer>
Integer PeekInteger(const uint8_t* at) {
  return static_cast<Integer>(LoadBigEndian<std::make_unsigned_t<Integer>>(at));
}

/// Of any message: the sim time of its header (µs), which begins behind the fingerprint.
inline int64_t PeekSimTime(const uint8_t* data) {
  return PeekInteger<int64_t>(data + OffsetOf<morphbus::header_t>("sim_time_us"));
}

/// Of WORLD and SENSORS, whose fields before their lists are the same: which part it is, and how
/// many there are.
static_assert(OffsetOf<morphbus::world_t>("part") == OffsetOf<morphbus::sensors_t>("part") &&
              OffsetOf<morphbus::world_t>("num_parts") ==
                  OffsetOf<morphbus::sensors_t>("num_parts"));
inline int16_t PeekPart(const uint8_t* data) {
  return PeekInteger<int16_t>(data + OffsetOf<morphbus::world_t>("part"));
}
inline int16_t PeekParts(const uint8_t* data) {
  return PeekInteger<int16_t>(data + OffsetOf<morphbus::world_t>("num_parts"));
}

/// Of SENSORS: one module's reading, as it stands in the message.
struct PeekedReading {
  uint16_t module_id;
  std::string_view name;
  const uint8_t* bytes;  ///< Where it begins.
};

/// Of SENSORS: calls `each` with every reading, in order. Returns where the orders behind them
/// begin: the lengths of four lists, with the lists behind them.
template <class Each>
const uint8_t* PeekReadings(const uint8_t* data, const Each& each) {
  const uint8_t* at = data + OffsetOf<morphbus::sensors_t>("num_modules");
  const auto count = PeekInteger<int16_t>(at);
  at += 2;
  for (int i = 0; i < count; ++i) {
    PeekedReading reading{PeekInteger<uint16_t>(at), {}, at};
    // The name's length counts its NUL.
    const auto length = static_cast<size_t>(PeekInteger<int32_t>(at + 2));
    reading.name = {reinterpret_cast<const char*>(at + 6), length - 1};
    at += 6 + length;
    // A position (8 bytes), a velocity and an effort (4 each) for each joint, what its sensors
    // measure, then what is docked.
    const size_t joints = *at++;
    at += 16 * joints;
    const size_t values = *at++;
    at += 4 * values;
    const size_t docked = *at++;
    at += docked * LargestSize<morphbus::docked_connector_t>();
    each(reading);
  }
  return at;
}

/// Of ACTUATOR: how many STATUS its module has published.
inline int64_t PeekStatusCount(const uint8_t* data) {
  return PeekInteger<int64_t>(data + OffsetOf<morphbus::actuator_t>("status_count"));
}

/// Of TRANSFORM: role, and whether it has poses and whether they age.
inline int16_t PeekRole(const uint8_t* data) {
  return PeekInteger<int16_t>(data + OffsetOf<morphbus::transform_t>("role"));
}
/// Where a field behind the shared ones begins, of which each has 4 bytes; `offset` is as if there
/// were none.
inline const uint8_t* PeekBehindShared(const uint8_t* data, uint32_t offset) {
  return data + offset + 4 * size_t{data[OffsetOf<morphbus::transform_t>("num_shared")]};
}
inline bool PeekHasPose(const uint8_t* data) {
  return *PeekBehindShared(data, OffsetOf<morphbus::transform_t>("has_pose")) != 0;
}
inline bool PeekPoseStale(const uint8_t* data) {
  return *PeekBehindShared(data, OffsetOf<morphbus::transform_t>("pose_stale")) != 0;
}

/// Of TRANSFORM: the poses of its links, X_RL.
inline void PeekLinkPoses(const uint8_t* data, std::vector<morphbus::pose_t>* out) {
  const uint8_t* at = PeekBehindShared(data, OffsetOf<morphbus::transform_t>("num_links"));
  out->resize(static_cast<size_t>(*at++));
  const auto next = [&at] {
    const auto value = std::bit_cast<float>(PeekInteger<int32_t>(at));
    at += 4;
    return value;
  };
  for (morphbus::pose_t& pose : *out) {
    for (float& p : pose.position_m) p = next();
    for (float& q : pose.orientation_wxyz) q = next();
  }
}

}  // namespace morphbus::bridge
