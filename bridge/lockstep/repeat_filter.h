#pragma once
// Which messages outside the run's hash have come before: a network may double them, and whoever
// hears them may say them again, authentic as they are.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

#include "bridge/wire/channels.h"
#include "compiler/base/text_hash.h"

namespace morphbus::bridge {

/// Which numbers of one publisher on one channel have come: an anti-replay window (RFC 4303, Sec.
/// 3.4.3), which takes the same small memory whatever comes.
class NumberWindow {
 public:
  /// Of so many numbers up to the highest it is known whether they have come. What is older counts
  /// as if it had.
  static constexpr uint64_t kSize = 64;
  /// Takes a number, 0 or more. Returns false if it has come before, or is too old.
  bool Take(int64_t number);

 private:
  /// The highest number taken; -1 before the first one.
  int64_t highest_ = -1;
  /// Bit i: `highest_` - i has come.
  uint64_t taken_ = 0;
};

/// The one rule for everything that no machine asks for again: of each publisher's numbers on a
/// channel each counts once, before anything acts on it. What is said again on purpose has a new
/// number; a process that is started again begins with higher ones (Outbox::BeginAt).
class RepeatFilter {
 public:
  /// Publishers that are remembered, the latest: tools and commands come and go.
  static constexpr size_t kMostPublishers = 65536;

  /// Takes a message on a channel outside the hash. Returns true if it has come before; false for
  /// one that is not sound, of which nothing is noted.
  bool IsRepeat(const ChannelName& name, const uint8_t* data, size_t size);

 private:
  TextTable<NumberWindow> windows_;
  std::deque<std::string> publishers_;  ///< The keys of windows_, oldest first.
};

}  // namespace morphbus::bridge
