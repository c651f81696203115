#pragma once
// What teaches a shell to complete the words of `morphbus`.

#include <string>
#include <vector>

namespace morphbus::tools {

/// The shells for which there is a script.
std::vector<std::string> Shells();

/// The script for one of them, which asks `morphbus complete` (tools/shell/completion.h); empty for
/// any other shell.
std::string CompletionScript(const std::string& shell);

}  // namespace morphbus::tools
