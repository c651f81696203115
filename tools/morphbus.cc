// The program `morphbus`: reads the command line and hands over to one subcommand.

#include <csignal>

#include "tools/command_line.h"

int main(int argc, char** argv) {
  // A reader that goes away (`morphbus fk ... | head`) ends us by the error of the write, not a signal
  // in the middle of a run.
  std::signal(SIGPIPE, SIG_IGN);
  return morphbus::tools::RunCommandLine(argc, argv);
}
