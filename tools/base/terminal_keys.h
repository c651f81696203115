#pragma once
// Single keys from a terminal, without Enter and without waiting for them.

#include <termios.h>

#include <optional>
#include <string>

namespace morphbus::tools {

/// A key that was pressed.
struct TerminalKey {
  enum class Kind { kCharacter, kLeft, kRight, kPageUp, kPageDown, kHome, kOther };
  Kind kind = Kind::kCharacter;
  char character = 0;  ///< Of kCharacter.

  bool operator==(const TerminalKey&) const = default;
};

/// Takes the first key off the front of what a terminal sent, escape sequences of the xterm family
/// included; what is none of those that are known is kOther. Nothing if `bytes` is empty or ends
/// within a sequence, of which the rest may follow; `complete` says that nothing will follow.
std::optional<TerminalKey> TakeKey(std::string* bytes, bool complete);

/// Reads keys from `fd`. A terminal is put into a mode in which keys come at once and unseen; the
/// destructor restores it. Ctrl-C and Ctrl-Z work as ever. While the process is in the background
/// of its terminal it touches neither its mode nor its keys. From anything else than a terminal
/// characters are taken as if they were typed.
class TerminalKeys {
 public:
  explicit TerminalKeys(int fd);
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// The next key, if one was pressed; never waits.
  std::optional<TerminalKey> Next();
  /// True once no key will ever come: the input has ended.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  /// Whether the terminal is ours now: a process in the background is stopped if it reads.
  [[nodiscard]] bool InForeground() const;
  /// Puts the terminal into our mode, also after another program (a shell, after Ctrl-Z) changed
  /// it.
  void SetMode();

  int fd_;
  bool is_terminal_;
  /// The mode to be restored; none while it has not been changed.
  std::optional<termios> original_;
  std::string bytes_;
  bool ended_ = false;
};

}  // namespace morphbus::tools
