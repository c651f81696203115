#include "vm/port/frame.h"

#include <cstring>

namespace morphbus::vm {

namespace {

constexpr uint8_t kStart = 0xA5;

/// Differs for lengths that differ in any burst of up to eight bits, so that few bytes wait in vain
/// for a long frame whose length is damaged.
uint8_t LengthCheck(uint8_t low, uint8_t high) { return static_cast<uint8_t>(~(low ^ high)); }

/// CRC-32 as in Ethernet and zlib, bit by bit: a table would take a kilobyte of flash.
uint32_t Crc(const uint8_t* bytes, int size) {
  uint32_t crc = 0xffffffff;
  for (int i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1)));
  }
  return ~crc;
}

/// Writes the CRC behind `size` bytes, lowest byte first; or asks whether it is there.
void PutCrc(uint8_t* bytes, int size) {
  const uint32_t crc = Crc(bytes, size);
  for (int i = 0; i < 4; ++i) bytes[size + i] = static_cast<uint8_t>(crc >> (8 * i));
}
bool HasCrc(const uint8_t* bytes, int size) {
  // The CRC of bytes and their own CRC is always the same number.
  return Crc(bytes, size + 4) == 0x2144df1c;
}

}  // namespace

int WriteFrame(uint8_t* frame, int size) {
  frame[0] = kStart;
  frame[1] = static_cast<uint8_t>(size);
  frame[2] = static_cast<uint8_t>(size >> 8);
  frame[3] = LengthCheck(frame[1], frame[2]);
  PutCrc(frame, kFrameHeadBytes + size);
  return kFrameHeadBytes + size + kFrameTailBytes;
}

bool FrameReader::Next() {
  // The frame that was told last is done with.
  Drop(found_);
  found_ = 0;
  while (size_ > 0) {
    // A head shows what it is when it is whole; until then what has come of it may be one.
    body_size_ = size_ < kFrameHeadBytes ? 0 : bytes_[1] | bytes_[2] << 8;
    if (bytes_[0] != kStart || body_size_ > kMaxFrameBodyBytes ||
        (size_ >= kFrameHeadBytes && bytes_[3] != LengthCheck(bytes_[1], bytes_[2]))) {
      SkipToStart();
      continue;
    }
    const int whole = kFrameHeadBytes + body_size_ + kFrameTailBytes;
    // Its end may still be on the way.
    if (size_ < whole) return false;
    if (HasCrc(bytes_, kFrameHeadBytes + body_size_)) {
      found_ = whole;
      return true;
    }
    SkipToStart();
  }
  return false;
}

void FrameReader::SkipToStart() {
  // A frame may begin anywhere in what was no frame.
  int at = 1;
  while (at < size_ && bytes_[at] != kStart) ++at;
  Drop(at);
}

void FrameReader::Drop(int count) {
  size_ -= count;
  std::memmove(bytes_, bytes_ + count, static_cast<size_t>(size_));
}

}  // namespace morphbus::vm
