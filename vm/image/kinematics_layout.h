#pragma once
// Byte layout of a kinematics image, shared by its decoder and its encoder. Little-endian, nothing
// aligned; text is a u8 length and the characters.
//
//   header      magic u32, version u16, reserved u16 (0), size u32, connections u32, hash u64,
//               model hash u64, counts u8 of links, joints, connectors, sensors
//   type name   text
//   link        name text
//   joint       name text, kind u8, link a u8, link b u8, then floats: origin (3), axis (3), lower,
//               upper, speed
//   connector   name text, link u8, states u8, then states of {name text, values u8}
//   sensor      name text, kind u8, link u8, then floats: direction (3), range
//   connection  connection type u8, flags u8 (bit 0: this module is member b), number u16,
//               connector u8, mate connector u8, reserved u16 (0), X_MN as 7 floats (p x y z,
//               q w x y z); sorted by connector, type, flags, number, no two alike

#include <cstdint>

namespace morphbus::vm::kinematics {

inline constexpr uint32_t kMagic = 0x4e494b4du;  // "MKIN"
inline constexpr uint16_t kVersion = 1;
inline constexpr uint32_t kVersionAt = 4;
inline constexpr uint32_t kSizeAt = 8;
inline constexpr uint32_t kConnectionsAt = 12;
inline constexpr uint32_t kHashAt = 16;  // As in a program image, so that the hash is the same.
inline constexpr uint32_t kModelHashAt = 24;
inline constexpr uint32_t kCountsAt = 32;
inline constexpr uint32_t kHeaderBytes = 36;
inline constexpr uint32_t kConnectionBytes = 36;
inline constexpr uint8_t kMemberBFlag = 1;

}  // namespace morphbus::vm::kinematics
