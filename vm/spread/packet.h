#pragma once
// What a module tells its neighbours, as bytes for a link without LCM: a serial line, a radio, an
// infrared diode. Little-endian, nothing aligned, only what is there; docs/porting.md has the
// layout. TRANSFORM (lcmtypes/transform_t.lcm) is the same message on the bus.

#include <cstdint>

#include "vm/module_api.h"

namespace morphbus::vm {

/// The first byte of a packet: another layout gets another number.
inline constexpr uint8_t kPacketVersion = 2;

/// No packet of this profile is longer (bytes).
inline constexpr int kMaxPacketBytes =
    101 + 4 * kMaxSharedFields + 28 * kMaxLinks + 5 * kMaxNeighbours + 8 * kMaxMessageBodyEntries +
    (26 + 4 * kMaxArguments) * kMaxMessageInvocations + 14 * kMaxMessageAcks + kFragmentBytes;

/// Writes a message to `out`, which has room for kMaxPacketBytes; returns how many bytes it took.
int WritePacket(const NeighbourMessage& message, uint8_t* out);

/// Reads what WritePacket wrote; false, with `*message` in no particular state, if the bytes are no
/// packet: cut off, too long, of another version, or with more than the profile has room for. What
/// the numbers mean is judged where they are used (vm/space/neighbours.cc).
bool ReadPacket(const uint8_t* bytes, int size, NeighbourMessage* message);

}  // namespace morphbus::vm
