// The program `morphbus`: reads the command line and hands over to one subcommand.

#include "compiler/base/standard_streams.h"
#include "compiler/base/temporary_files.h"
#include "tools/commands/command_line.h"

int main(int argc, char** argv) {
  morphbus::PrepareStandardStreams();
  morphbus::RemoveTemporariesOnSignal();
  return morphbus::tools::RunCommandLine(argc, argv);
}
