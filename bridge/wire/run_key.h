#pragma once
// The secret of a run, by which its processes know their own messages from everybody else's
// (lcmtypes/README.md, Who is believed).

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "compiler/base/result.h"

namespace morphbus::bridge {

/// The key of one run: whoever has it may speak in the run in any process's name. Of an open run:
/// none, and then the `auth` of all its messages is 0. Copies are equal keys.
class RunKey {
 public:
  /// Size of a key, bytes: SipHash's.
  static constexpr size_t kSize = 16;
  using Bytes = std::array<uint8_t, kSize>;

  /// That of an open run.
  RunKey() = default;
  explicit RunKey(const Bytes& bytes) : bytes_(bytes), open_(false) {}

  /// A fresh one. Fails if the system has no random numbers.
  static Result<RunKey> Random();
  /// The one in a file. Fails if the file holds none, is somebody else's, or may be read by others.
  static Result<RunKey> Read(const std::string& path);
  /// Writes it to a new file of mode 0600. Fails if there is such a file already. It is not open.
  [[nodiscard]] Result<void> WriteTo(const std::string& path) const;

  /// Whether the run has no key.
  [[nodiscard]] bool open() const { return open_; }

  /// What `auth` of this message must be: SipHash-2-4 (by libsodium) of the channel's length (one
  /// byte), the channel and the message, of which the bytes of `crc32` and `auth` count as zero.
  /// @param size  from kContentOffset to kMaxPayloadBytes.
  /// @param channel  at most kMaxChannelName bytes.
  [[nodiscard]] uint64_t AuthOf(std::string_view channel, const uint8_t* data, size_t size) const;
  /// Writes `auth` and the CRC that belongs to it into a message that is to go out on `channel`.
  void Seal(std::string_view channel, uint8_t* data, size_t size) const;
  /// Whether a message that came on `channel` carries the right `auth`. The bytes may be anything.
  [[nodiscard]] bool IsAuthentic(std::string_view channel, const uint8_t* data, size_t size) const;

 private:
  Bytes bytes_ = {};
  bool open_ = true;
};

}  // namespace morphbus::bridge
