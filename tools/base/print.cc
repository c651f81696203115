#include "tools/base/print.h"

#include <cerrno>
#include <cstdio>
#include <string>

namespace morphbus::tools {
namespace {

/// The first errno of stdout: stdio remembers only that something failed.
int g_result_error = 0;

/// Whether a line of ShowPassing stands on the terminal.
bool g_passing = false;

/// Who keeps what this thread says; null: nobody.
thread_local HeldSaying* t_held = nullptr;

/// \r goes to the beginning of the line, and \033[K clears it.
constexpr std::string_view kClearLine = "\r\033[K";

/// A failure has no place where it could be told, so that the result is not looked at. stderr has
/// no buffer.
void WriteError(std::string_view text) {
  if (!text.empty()) static_cast<void>(std::fwrite(text.data(), 1, text.size(), stderr));
}

}  // namespace

void PrintText(std::string_view text) {
  ShowPassing("");
  // An empty text may be a null pointer, which fwrite() does not take.
  if (g_result_error != 0 || text.empty()) return;
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) {
    g_result_error = errno != 0 ? errno : EIO;
  }
}

HeldSaying::HeldSaying() : outer_(t_held) { t_held = this; }
HeldSaying::~HeldSaying() { t_held = outer_; }
bool HeldSaying::Any() { return t_held != nullptr; }

void SayText(std::string_view text) {
  if (t_held != nullptr) {
    t_held->text_ += text;
    return;
  }
  ShowPassing("");
  WriteError(text);
}

void ShowPassing(std::string_view line) {
  if (line.empty() && !g_passing) return;
  g_passing = !line.empty();
  WriteError(std::string(kClearLine).append(line));
}

int FlushResult() {
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  if (g_result_error == 0 && !flushed) g_result_error = errno != 0 ? errno : EIO;
  // The library that reads the options prints help past us.
  if (g_result_error == 0 && std::ferror(stdout) != 0) g_result_error = EIO;
  return g_result_error;
}

}  // namespace morphbus::tools
