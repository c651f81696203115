#include "bridge/control/control_seal.h"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "bridge/control/control_command.h"
#include "compiler/base/check.h"

namespace morphbus::bridge {
namespace {

/// Commands that are remembered, to tell one that comes again from one that was overtaken.
constexpr size_t kRemembered = 1024;

/// A failure of the system with a file.
tl::unexpected<Error> FailFile(const std::string& what, const std::string& path) {
  return Fail("cannot " + what + " " + path + ": " + std::strerror(errno));
}

}  // namespace

Result<void> CreateControlKey(const std::string& path) {
  // The kernel's random numbers serve for keys.
  ControlKey key;
  if (getrandom(key.data(), key.size(), 0) != static_cast<ssize_t>(key.size())) {
    return Fail("the system has no random numbers");
  }
  // The mode is right from the start; a file that somebody else made is not used.
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return FailFile("create", path);
  const bool written = write(fd, key.data(), key.size()) == static_cast<ssize_t>(key.size());
  close(fd);
  return written ? Result<void>() : FailFile("write", path);
}

Result<ControlKey> ReadControlKey(const std::string& path) {
  // A link could lead to a key that somebody else knows.
  ControlKey key;
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (fd < 0) return FailFile("read", path);
  struct stat info = {};
  const bool known = fstat(fd, &info) == 0;
  const ssize_t size = read(fd, key.data(), key.size());
  close(fd);
  // Whoever else can read the key could command the run.
  if (!known || (info.st_mode & 077) != 0) return Fail(path + " is not private to its owner");
  if (size != static_cast<ssize_t>(key.size())) return Fail(path + " is no key");
  return key;
}

std::array<uint8_t, 32> ControlMac(const ControlKey& key, int64_t counter,
                                   const std::string& command) {
  // The counter stands before the command, where a command of any length cannot imitate it.
  std::vector<uint8_t> text;
  for (int shift = 56; shift >= 0; shift -= 8) {
    text.push_back(static_cast<uint8_t>(static_cast<uint64_t>(counter) >> shift));
  }
  text.insert(text.end(), command.begin(), command.end());
  std::array<uint8_t, 32> mac = {};
  unsigned size = 0;
  MORPHBUS_CHECK(HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), text.data(),
                      text.size(), mac.data(), &size) != nullptr &&
                 size == mac.size());
  return mac;
}

morphbus::control_t Seal(const ControlKey& key, int64_t counter, const std::string& command) {
  morphbus::control_t message;
  message.counter = counter;
  message.command = command;
  message.header.sequence = 0;  // Until it is sent: the outbox numbers it.
  const std::array<uint8_t, 32> mac = ControlMac(key, counter, command);
  std::copy(mac.begin(), mac.end(), message.mac);
  return message;
}

ControlGuard::Verdict ControlGuard::Judge(const morphbus::control_t& message, int64_t now_us) {
  // The comparison takes as long whatever the bytes are, so that it tells nothing of the right
  // ones.
  const std::array<uint8_t, 32> mac = ControlMac(key_, message.counter, message.command);
  if (CRYPTO_memcmp(mac.data(), message.mac, mac.size()) != 0) {
    ++ledger_.forged_commands;
    return Verdict::kForged;
  }
  if (IsAnswer(message.command)) return Verdict::kAnswer;
  // Again or overtaken is told apart before age, so that a repetition is always known as one.
  const auto again = std::find_if(taken_.begin(), taken_.end(), [&](const Taken& taken) {
    return taken.counter == message.counter;
  });
  if (again != taken_.end()) {
    const bool anew = message.header.sequence > again->sequence;
    ++(anew ? ledger_.duplicates : ledger_.replayed_commands);
    again->sequence = std::max(again->sequence, message.header.sequence);
    return Verdict::kAgain;
  }
  // A message that was kept back must not do tomorrow what was meant for today.
  if (message.counter < now_us - kFreshUs || message.counter > now_us + kFreshUs) {
    ++ledger_.late_commands;
    return Verdict::kLate;
  }
  if (message.counter <= last_) {
    ++ledger_.replayed_commands;
    return Verdict::kOvertaken;
  }
  // From here on this one, and everything before it, is known.
  last_ = message.counter;
  taken_.push_back({last_, message.header.sequence});
  if (taken_.size() > kRemembered) taken_.pop_front();
  return Verdict::kObey;
}

}  // namespace morphbus::bridge
