#include "bridge/wire/run_key.h"

#include <fcntl.h>
#include <sodium/crypto_shorthash_siphash24.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "bridge/bus/bus.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/wire_limits.h"
#include "compiler/base/big_endian.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

static_assert(crypto_shorthash_siphash24_KEYBYTES == RunKey::kSize &&
              crypto_shorthash_siphash24_BYTES == 8);

/// A failure of the system with a file.
tl::unexpected<Error> FailWithFile(const std::string& what, const std::string& path) {
  return Fail("cannot " + what + " " + path + ": " + std::strerror(errno));
}

}  // namespace

Result<RunKey> RunKey::Random() {
  // The kernel's random numbers serve for keys.
  Bytes bytes;
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return Fail("the system has no random numbers");
  }
  return RunKey(bytes);
}

Result<void> RunKey::WriteTo(const std::string& path) const {
  MORPHBUS_CHECK(!open_);
  // The mode is right from the start; a file that somebody else made is not used.
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return FailWithFile("create", path);
  const bool written = write(fd, bytes_.data(), kSize) == static_cast<ssize_t>(kSize);
  close(fd);
  if (!written) return FailWithFile("write", path);
  return {};
}

Result<RunKey> RunKey::Read(const std::string& path) {
  // A link could lead to a key that somebody else knows. One byte more shows a file that is longer.
  std::array<uint8_t, kSize + 1> bytes;
  // A named pipe is not waited for.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (fd < 0) return FailWithFile("read", path);
  struct stat info = {};
  const bool known = fstat(fd, &info) == 0;
  const ssize_t size = read(fd, bytes.data(), bytes.size());
  close(fd);
  // What is no key keeps its mode: only of a key it is said how it becomes private.
  if (!known || !S_ISREG(info.st_mode) || size != static_cast<ssize_t>(kSize)) {
    return Fail(path + " is no key, which is a file of 16 bytes");
  }
  // Other users who know the key could speak in the run.
  if (info.st_uid != geteuid()) return Fail(path + " belongs to another user");
  if ((info.st_mode & 077) != 0) {
    return Fail(path + " is not private to its owner: chmod 600 " + path);
  }
  Bytes key;
  std::copy_n(bytes.begin(), kSize, key.begin());
  return RunKey(key);
}

uint64_t RunKey::AuthOf(std::string_view channel, const uint8_t* data, size_t size) const {
  MORPHBUS_CHECK(channel.size() <= kMaxChannelName && size >= kContentOffset &&
                 size <= kMaxPayloadBytes);
  // The name's length stands before it, so that no name runs on into the message.
  std::array<uint8_t, 1 + kMaxChannelName + kMaxPayloadBytes> text;
  text[0] = static_cast<uint8_t>(channel.size());
  std::memcpy(text.data() + 1, channel.data(), channel.size());
  uint8_t* const message = text.data() + 1 + channel.size();
  std::memcpy(message, data, size);
  std::memset(message + kCrcOffset, 0, kContentOffset - kCrcOffset);
  std::array<uint8_t, crypto_shorthash_siphash24_BYTES> hash;
  crypto_shorthash_siphash24(hash.data(), text.data(), 1 + channel.size() + size, bytes_.data());
  // SipHash's result is a number, which libsodium gives with its lowest byte first.
  uint64_t auth = 0;
  for (size_t i = hash.size(); i-- > 0;) auth = auth << 8 | hash[i];
  return auth;
}

void RunKey::Seal(std::string_view channel, uint8_t* data, size_t size) const {
  if (open_) return;
  StoreBigEndian(AuthOf(channel, data, size), data + kAuthOffset);
  PatchCrc(data, size);
}

bool RunKey::IsAuthentic(std::string_view channel, const uint8_t* data, size_t size) const {
  // No message of a run is shorter than its header or longer than a datagram may be.
  if (size < kContentOffset || size > kMaxPayloadBytes || channel.size() > kMaxChannelName) {
    return false;
  }
  const auto auth = LoadBigEndian<uint64_t>(data + kAuthOffset);
  return auth == (open_ ? 0 : AuthOf(channel, data, size));
}

}  // namespace morphbus::bridge
