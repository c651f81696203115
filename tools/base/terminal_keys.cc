#include "tools/base/terminal_keys.h"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <utility>

namespace morphbus::tools {
namespace {

constexpr char kEscape = '\x1B';

/// Keys by their sequences, in normal and application mode.
constexpr std::pair<std::string_view, TerminalKey::Kind> kSequences[] = {
    {"\x1B[D", TerminalKey::Kind::kLeft},    {"\x1BOD", TerminalKey::Kind::kLeft},
    {"\x1B[C", TerminalKey::Kind::kRight},   {"\x1BOC", TerminalKey::Kind::kRight},
    {"\x1B[5~", TerminalKey::Kind::kPageUp}, {"\x1B[6~", TerminalKey::Kind::kPageDown},
    {"\x1B[H", TerminalKey::Kind::kHome},    {"\x1BOH", TerminalKey::Kind::kHome},
    {"\x1B[1~", TerminalKey::Kind::kHome}};

/// How long the escape sequence at the front is; 0 if its end has not come. A sequence is ESC O and
/// a character, or ESC [, parameters, and a character from @ to ~ (ECMA-48, 5.4).
size_t SequenceSize(std::string_view bytes) {
  if (bytes.size() < 2) return 0;
  if (bytes[1] == 'O') return bytes.size() < 3 ? 0 : 3;
  if (bytes[1] != '[') return 1;  // The escape key, and then another.
  for (size_t i = 2; i < bytes.size(); ++i) {
    if (bytes[i] >= '@' && bytes[i] <= '~') return i + 1;
  }
  return 0;
}

}  // namespace

std::optional<TerminalKey> TakeKey(std::string* bytes, bool complete) {
  if (bytes->empty()) return std::nullopt;
  // A character is a key as it is.
  if (bytes->front() != kEscape) {
    const TerminalKey key{TerminalKey::Kind::kCharacter, bytes->front()};
    bytes->erase(0, 1);
    return key;
  }
  size_t size = SequenceSize(*bytes);
  if (size == 0 && !complete) return std::nullopt;
  if (size == 0) size = bytes->size();
  // A sequence that is not used here is taken whole, so that its rest is not read as characters.
  TerminalKey key{TerminalKey::Kind::kOther, 0};
  for (const auto& [sequence, kind] : kSequences) {
    if (std::string_view(*bytes).substr(0, size) == sequence) key.kind = kind;
  }
  bytes->erase(0, size);
  return key;
}

TerminalKeys::TerminalKeys(int fd) : fd_(fd), is_terminal_(isatty(fd) == 1) { SetMode(); }

TerminalKeys::~TerminalKeys() {
  if (original_ && InForeground()) tcsetattr(fd_, TCSADRAIN, &*original_);
}

bool TerminalKeys::InForeground() const { return tcgetpgrp(fd_) == getpgrp(); }

void TerminalKeys::SetMode() {
  termios mode{};
  // A program in the background that sets the mode would be stopped (SIGTTOU).
  if (!is_terminal_ || !InForeground() || tcgetattr(fd_, &mode) != 0) return;
  if ((mode.c_lflag & (ICANON | ECHO)) == 0) return;
  if (!original_) original_ = mode;
  // Keys come one by one and are not echoed.
  mode.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  mode.c_cc[VMIN] = 1;
  mode.c_cc[VTIME] = 0;
  tcsetattr(fd_, TCSADRAIN, &mode);
}

std::optional<TerminalKey> TerminalKeys::Next() {
  // After it was stopped and continued the shell has set another mode.
  SetMode();
  pollfd poll_fd = {fd_, POLLIN, 0};
  bool more = false;
  // A sequence comes in one piece; the limit keeps a flood of input from growing here.
  if (bytes_.size() < 64 && !ended_ && (!is_terminal_ || InForeground()) &&
      poll(&poll_fd, 1, 0) == 1 && poll_fd.revents != 0) {
    char buffer[64];
    const ssize_t n = read(fd_, buffer, sizeof buffer);
    if (n > 0) bytes_.append(buffer, static_cast<size_t>(n));
    ended_ = n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN);
    more = n > 0;
  }
  // What a terminal did not finish by now, as when ESC itself is pressed, is a key of its own.
  return TakeKey(&bytes_, !more);
}

}  // namespace morphbus::tools
