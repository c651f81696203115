#include "tools/base/print.h"

#include <cerrno>
#include <cstdio>

namespace morphbus::tools {
namespace {

/// The first errno of stdout: stdio remembers only that something failed.
int g_result_error = 0;

}  // namespace

void PrintText(std::string_view text) {
  if (g_result_error != 0) return;
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) {
    g_result_error = errno != 0 ? errno : EIO;
  }
}

void SayText(std::string_view text) {
  // stderr has no buffer: what this returns is all that there is to know, and nobody to tell it to.
  static_cast<void>(std::fwrite(text.data(), 1, text.size(), stderr));
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
