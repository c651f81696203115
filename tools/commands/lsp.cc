// morphbus lsp: what editors ask about M3L and DynaRole.

#include <memory>

#include "tools/commands/commands.h"
#include "tools/lsp/language_server.h"

namespace morphbus::tools {

void AddLsp(CommandLine* line) {
  Subcommand sub =
      line->Add("lsp", "Serve an editor: errors, names, completion, pictures (docs/editor.md)");
  // Editors add this option by habit; there is nothing else to speak over.
  auto stdio = std::make_shared<bool>(false);
  sub.Flag("--stdio", stdio.get(), "Over standard input and output, as always");
  sub.Footer(
      "Editors start it; docs/editor.md says how each is told to. It speaks the Language "
      "Server Protocol 3.17.\n"
      "Example:\n  morphbus lsp");
  sub.Do([stdio] { return ServeEditor(); });
}

}  // namespace morphbus::tools
