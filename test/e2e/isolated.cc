// Runs a command in a private network, for tests that bring their own processes to the bus.
//
//   isolated [--no-route] COMMAND ARGS...     --no-route: one in which multicast goes nowhere

#include <sched.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>

#include "tools/machine/network.h"

int main(int argc, char** argv) {
  const bool no_route = argc > 1 && std::strcmp(argv[1], "--no-route") == 0;
  char** command = argv + (no_route ? 2 : 1);
  if (*command == nullptr) return 2;
  if (no_route) {
    if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return 3;
  } else if (const auto entered = morphbus::tools::EnterPrivateNetwork(); !entered) {
    std::fprintf(stderr, "%s\n", entered.error().message.c_str());
    return 3;
  }
  execvp(*command, command);
  std::perror(*command);
  return 3;
}
