// Any text is a command or none: what is read is written as a text that is read as the same.

#include <string_view>

#include "bridge/control/control_command.h"
#include "compiler/base/check.h"

using morphbus::bridge::AnswerText;
using morphbus::bridge::ControlText;
using morphbus::bridge::ParseAnswer;
using morphbus::bridge::ParseControl;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto command = ParseControl(text)) {
    const std::string written = ControlText(*command);
    // Numbers may be longer than they were written; a command that grew too long is refused.
    const auto again = ParseControl(written);
    MORPHBUS_CHECK(again.has_value() || written.size() > size);
    if (again) MORPHBUS_CHECK(ControlText(*again) == written);
  }
  if (const auto answer = ParseAnswer(text)) {
    const auto again = ParseAnswer(AnswerText(*answer));
    MORPHBUS_CHECK(again && again->counter == answer->counter && again->state == answer->state);
  }
  return 0;
}
