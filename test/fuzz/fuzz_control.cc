// Any text is a command or none, and any bytes are a message that carries one or none: what is read
// is the same command as text and as a message.

#include <cstdint>
#include <morphbus/control_t.hpp>
#include <string_view>
#include <vector>

#include "bridge/control/control_service.h"
#include "bridge/wire/codec.h"
#include "compiler/base/check.h"

namespace {

using namespace morphbus::bridge;

/// A command as text, read back if it is not too long for that.
void CheckText(const ControlCommand& command, size_t longest) {
  const std::string written = ControlText(command);
  // Numbers may be longer than they were written; a command that grew too long is refused.
  const auto again = ParseControl(written);
  MORPHBUS_CHECK(again.has_value() || written.size() > longest);
  if (again) MORPHBUS_CHECK(ControlText(*again) == written);
}

/// Text as people write it.
void TryText(std::string_view text) {
  const auto command = ParseControl(text);
  if (!command) return;
  CheckText(*command, text.size());
  // Only the run itself says from which tick on a module has begun anew.
  ControlCommand given = *command;
  given.from = 0;
  const auto carried = CommandOf(MessageOf(given, 1));
  MORPHBUS_CHECK(carried && ControlText(*carried) == ControlText(given));
}

/// Bytes of a control_t, from anybody: what is the same in all of them is mended first.
void TryMessage(std::vector<uint8_t> bytes) {
  if (bytes.size() < kContentOffset + 4) return;
  const auto fingerprint = static_cast<uint64_t>(morphbus::control_t::getHash());
  for (size_t i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(fingerprint >> (56 - 8 * i));
  const auto protocol = static_cast<uint32_t>(morphbus::header_t::PROTOCOL);
  for (size_t i = 0; i < 4; ++i) {
    bytes[kContentOffset + i] = static_cast<uint8_t>(protocol >> (24 - 8 * i));
  }
  PatchCrc(bytes.data(), bytes.size());
  morphbus::control_t message;
  if (!Decode(bytes.data(), bytes.size(), {}, &message)) return;
  if (const auto command = CommandOf(message)) CheckText(*command, kLongestText);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  TryText({reinterpret_cast<const char*>(data), size});
  TryMessage({data, data + size});
  return 0;
}
