// The program `morphbus`: reads the command line and hands over to one subcommand.

#include "tools/commands/command_line.h"

int main(int argc, char** argv) { return morphbus::tools::RunCommandLine(argc, argv); }
