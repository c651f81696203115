// morphbus disasm: a program image as text.

#include <fmt/format.h>

#include "tools/base/print.h"
#include "tools/commands/commands.h"
#include "vm/image/disassembler.h"

namespace morphbus::tools {
namespace {

/// The disassembler verifies first: text of an image that would not run would mislead.
int Disasm(const std::string& path) {
  // The limit of 1 MiB is far above any image and keeps a wrong file out.
  const Result<std::string> bytes = ReadFile(path, 1 << 20);
  if (!bytes) return Unusable(bytes.error().message);
  bool ok = false;
  const std::string text = vm::DisassembleImage(reinterpret_cast<const uint8_t*>(bytes->data()),
                                                static_cast<uint32_t>(bytes->size()), &ok);
  if (!ok)
    // On failure the text is the message, which ends in a line feed.
    return Unusable(fmt::format("{}: {}", path, text.substr(0, text.find_last_not_of('\n') + 1)));
  PrintText(text);
  return kDone;
}

}  // namespace

void AddDisasm(CommandLine* line) {
  Subcommand sub = line->Add("disasm", "Print a program image as text");
  auto path = std::make_shared<std::string>();
  sub.Add("IMAGE", path.get(), "Program image (morphbus compile)").Required();
  sub.Footer("Example:\n  morphbus disasm quadruped.image");
  sub.Do([path] { return Disasm(*path); });
}

}  // namespace morphbus::tools
