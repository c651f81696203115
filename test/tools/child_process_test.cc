#include "tools/machine/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

namespace morphbus::tools {
namespace {

/// Waits for the end of `child`, as long as the test may take.
void Await(ChildProcess* child) {
  pollfd fd = {child->pidfd(), POLLIN, 0};
  poll(&fd, 1, -1);
  ASSERT_TRUE(child->Poll());
}

TEST(ChildProcessTest, AnExitStatusIsReported) {
  Result<ChildProcess> child = ChildProcess::Start({"x", {"/bin/sh", "-c", "exit 3"}});
  ASSERT_TRUE(child.has_value()) << child.error().message;
  Await(&*child);
  EXPECT_EQ(child->status(), 3);
  EXPECT_EQ(child->exit_text(), "exited with status 3");
}

TEST(ChildProcessTest, ASignalIsReported) {
  Result<ChildProcess> child = ChildProcess::Start({"x", {"/bin/sleep", "1000"}});
  ASSERT_TRUE(child.has_value());
  EXPECT_FALSE(child->Poll());
  child->Signal(SIGTERM);
  Await(&*child);
  EXPECT_EQ(child->status(), 128 + SIGTERM);
  EXPECT_EQ(child->exit_text(), "was killed by signal 15 (Terminated)");
}

TEST(ChildProcessTest, AMissingProgramIsNamed) {
  const Result<ChildProcess> child = ChildProcess::Start({"sim", {"/no/such/program"}});
  ASSERT_FALSE(child.has_value());
  EXPECT_EQ(child.error().message,
            "cannot start sim (/no/such/program): No such file or directory");
}

TEST(ChildProcessTest, ItStandsInAProcessGroupOfItsOwn) {
  Result<ChildProcess> child = ChildProcess::Start({"x", {"/bin/sleep", "1000"}});
  EXPECT_EQ(getpgid(child->pid()), child->pid());
}

TEST(ChildProcessTest, ItDiesWhenItsParentIsKilled) {
  // The grandchild holds the pipe's only writing end, so its death is the end of the file.
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    ChildProcess::Options options{"x", {"/bin/sleep", "1000"}};
    options.inherited_fds = {ends[1]};
    const Result<ChildProcess> child = ChildProcess::Start(options);
    kill(getpid(), child ? SIGKILL : SIGTERM);
  }
  close(ends[1]);
  int status = 0;
  waitpid(parent, &status, 0);
  EXPECT_EQ(WTERMSIG(status), SIGKILL);
  char byte = 0;
  EXPECT_EQ(read(ends[0], &byte, 1), 0);
  close(ends[0]);
}

}  // namespace
}  // namespace morphbus::tools
