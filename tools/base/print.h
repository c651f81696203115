#pragma once
// Text on stdout and stderr. Everything that a command prints goes through here: nothing throws, as
// {fmt}'s own print does where a stream cannot be written to (tools/lint/printing).

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace morphbus::tools {

/// Writes to stdout, the result of a command. A failure is kept for FlushResult(); nothing is
/// written after it.
void PrintText(std::string_view text);
/// Writes to stderr, what a person is told beside the result. That it cannot be said is no reason
/// to stop, and so is not reported.
void SayText(std::string_view text);

/// PrintText of a format and its arguments.
template <typename... T>
void Print(fmt::format_string<T...> format, T&&... arguments) {
  PrintText(fmt::format(format, std::forward<T>(arguments)...));
}
/// SayText of a format and its arguments.
template <typename... T>
void Say(fmt::format_string<T...> format, T&&... arguments) {
  SayText(fmt::format(format, std::forward<T>(arguments)...));
}

/// While it lives, what its thread would write to stderr is kept instead: for libraries, whose
/// errors are exceptions. The last one that was made counts.
class HeldSaying {
 public:
  HeldSaying();
  ~HeldSaying();
  HeldSaying(const HeldSaying&) = delete;
  HeldSaying& operator=(const HeldSaying&) = delete;
  /// What has been said so far.
  [[nodiscard]] const std::string& text() const { return text_; }
  /// Whether there is one in this thread.
  [[nodiscard]] static bool Any();

 private:
  friend void SayText(std::string_view text);
  std::string text_;
  HeldSaying* outer_;
};

/// A line on stderr that the next thing printed, on either stream, takes away: progress. Only for a
/// terminal that can redraw a line (IsFancyTerminal). Empty: just takes away what stands there.
void ShowPassing(std::string_view line);

/// Hands to the operating system what waits for stdout. Returns 0, or the first errno with which
/// anything that was printed so far could not be written.
int FlushResult();

}  // namespace morphbus::tools
