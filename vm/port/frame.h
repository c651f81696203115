#pragma once
// Bodies of bytes on a line that cuts, loses and damages bytes. docs/porting.md has the layout.

#include <cstdint>

#include "vm/spread/packet.h"

namespace morphbus::vm {

/// Who speaks (module, connector), and then its packet.
inline constexpr int kMaxFrameBodyBytes = 3 + kMaxPacketBytes;
/// Start, length and its check before the body; CRC-32 behind it.
inline constexpr int kFrameHeadBytes = 4, kFrameTailBytes = 4;
inline constexpr int kMaxFrameBytes = kFrameHeadBytes + kMaxFrameBodyBytes + kFrameTailBytes;

static_assert(kMaxFrameBodyBytes <= 0xffff);

/// Makes a frame of the `size` bytes at frame + kFrameHeadBytes, kMaxFrameBodyBytes at most;
/// returns how long it is in all.
int WriteFrame(uint8_t* frame, int size);

/// Finds the frames among the bytes of one line. One that comes whole is not lost by what was on
/// the line before it, unless its first bytes make a frame of that. Put() a byte, then call Next()
/// until it says false.
class FrameReader {
 public:
  /// Takes one byte. There is room for it whenever Next() has just said false.
  void Put(uint8_t byte) { bytes_[size_++] = byte; }
  /// True if there is a frame, whose body is then in body() until Next() or Put() is called.
  bool Next();
  [[nodiscard]] const uint8_t* body() const { return bytes_ + kFrameHeadBytes; }
  [[nodiscard]] int body_size() const { return body_size_; }

 private:
  /// Drops the byte that comes first, and those behind it that begin no frame.
  void SkipToStart();
  void Drop(int count);

  /// What has come and may still belong to a frame; the frame that was found lies at its beginning.
  uint8_t bytes_[kMaxFrameBytes];
  int size_ = 0, body_size_ = 0, found_ = 0;
};

}  // namespace morphbus::vm
