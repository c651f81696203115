// morphbus disasm: a program image as text.

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/commands.h"
#include "vm/disassembler.h"

namespace morphbus::tools {
namespace {

int Disasm(const std::string& path) {
  const Result<std::string> bytes = ReadFile(path, 1 << 20);
  if (!bytes) return Unusable(bytes.error().message);
  bool ok = false;
  const std::string text = vm::DisassembleImage(reinterpret_cast<const uint8_t*>(bytes->data()),
                                                static_cast<uint32_t>(bytes->size()), &ok);
  if (!ok)
    return Unusable(fmt::format("{}: {}", path, text.substr(0, text.find_last_not_of('\n') + 1)));
  fmt::print("{}", text);
  return kDone;
}

}  // namespace

void AddDisasm(CLI::App& app, Action* action) {
  CLI::App* sub = app.add_subcommand("disasm", "Print a program image as text");
  auto path = std::make_shared<std::string>();
  sub->add_option("IMAGE", *path, "Program image (morphbus compile)")->required();
  sub->footer("Example:\n  morphbus disasm quadruped.image");
  sub->callback([path, action] { *action = [path] { return Disasm(*path); }; });
}

}  // namespace morphbus::tools
