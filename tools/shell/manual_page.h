#pragma once
// Manual pages, made of what the help says.

#include <string>

#include "tools/base/command_help.h"

namespace morphbus::tools {

/// "morphbus-run", under which the page of a command is found; that of the program itself has its
/// name.
std::string ManualName(const CommandHelp& program, const CommandHelp* command);

/// The page, of section 1, in roff with man's macros. It tells no date, so that two builds of one
/// version make the same.
/// @param command  one of the program's, whose own commands are on its page, too; null: of the
/// program.
/// @param version  as --version says it.
std::string ManualPage(const CommandHelp& program, const CommandHelp* command,
                       const std::string& version);

}  // namespace morphbus::tools
