#include "tools/machine/run_registry.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

class RunRegistryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "registry.XXXXXX";
    folder_ = mkdtemp(pattern.data());
    setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static RunEntry Entry(const std::string& robot) {
    RunEntry entry;
    entry.pid = getpid();
    entry.since = "2024-01-01T00:00:00+0000";
    entry.robot = robot;
    entry.isolated = true;
    return entry;
  }
  std::string folder_;
};

TEST_F(RunRegistryTest, APublishedRunIsListedAndGoneAfterwards) {
  {
    Result<RunDirectory> run = RunDirectory::Claim("a");
    ASSERT_TRUE(run.has_value()) << run.error().message;
    ASSERT_TRUE(run->Publish(Entry("quadruped")).has_value());
    const Result<std::vector<RunEntry>> runs = ListRuns();
    ASSERT_TRUE(runs.has_value());
    ASSERT_EQ(runs->size(), 1u);
    EXPECT_EQ(runs->front().name, "a");
    EXPECT_EQ(runs->front().robot, "quadruped");
    EXPECT_EQ(runs->front().pid, getpid());
    EXPECT_TRUE(runs->front().isolated);
  }
  EXPECT_TRUE(ListRuns()->empty());
  EXPECT_TRUE(fs::is_empty(folder_ + "/morphbus"));
}

TEST_F(RunRegistryTest, ANameInUseIsRefusedNamingItsHolder) {
  std::optional<Result<RunDirectory>> first(RunDirectory::Claim("a"));
  ASSERT_TRUE((*first)->Publish(Entry("q")).has_value());
  const Result<RunDirectory> second = RunDirectory::Claim("a");
  ASSERT_FALSE(second.has_value());
  EXPECT_NE(second.error().message.find("already in use by process " + std::to_string(getpid())),
            std::string::npos)
      << second.error().message;
  first.reset();
  EXPECT_TRUE(RunDirectory::Claim("a").has_value());
}

TEST_F(RunRegistryTest, TheOnlyRunIsTheOneWithABusWhereOthersAreInOneProcess) {
  const Result<RunDirectory> alone = RunDirectory::Claim("alone");
  ASSERT_TRUE(alone->Publish(Entry("q")).has_value());
  EXPECT_EQ(FindRun("")->name, "alone");
  const Result<RunDirectory> also = RunDirectory::Claim("also");
  ASSERT_TRUE(also->Publish(Entry("q")).has_value());
  EXPECT_FALSE(FindRun("").has_value());
  RunEntry with_bus = Entry("q");
  with_bus.url = "udpm://239.255.76.67:7667?ttl=0";
  const Result<RunDirectory> joined = RunDirectory::Claim("joined");
  ASSERT_TRUE(joined->Publish(with_bus).has_value());
  EXPECT_EQ(FindRun("")->name, "joined");
  EXPECT_EQ(FindRun("also")->name, "also");
  const Result<RunDirectory> second = RunDirectory::Claim("second");
  ASSERT_TRUE(second->Publish(with_bus).has_value());
  EXPECT_FALSE(FindRun("").has_value());
}

TEST_F(RunRegistryTest, FreshNamesDiffer) {
  const Result<RunDirectory> a = RunDirectory::Claim("");
  const Result<RunDirectory> b = RunDirectory::Claim("");
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_NE(a->name(), b->name());
}

TEST_F(RunRegistryTest, WhatAKilledLauncherLeavesIsCleaned) {
  const pid_t pid = fork();
  if (pid == 0) {
    Result<RunDirectory> run = RunDirectory::Claim("dead");
    if (run) (void)run->Publish(Entry("q"));
    kill(getpid(), SIGKILL);
  }
  waitpid(pid, nullptr, 0);
  ASSERT_TRUE(fs::exists(folder_ + "/morphbus/dead/run.json"));
  EXPECT_TRUE(ListRuns()->empty());
  EXPECT_FALSE(fs::exists(folder_ + "/morphbus/dead"));
  EXPECT_TRUE(RunDirectory::Claim("dead").has_value());
}

TEST_F(RunRegistryTest, WhoClaimsTheNameOfAKilledRunFindsNothingOfIt) {
  const std::string path = folder_ + "/morphbus/dead";
  fs::create_directories(path + "/old");
  fs::permissions(folder_ + "/morphbus", fs::perms::owner_all);
  for (const char* name : {"lock", "run.json", "key", "commands", "old/file"}) {
    std::ofstream(path + "/" + name) << "x";
  }
  const Result<RunDirectory> run = RunDirectory::Claim("dead");
  ASSERT_TRUE(run.has_value()) << run.error().message;
  std::vector<std::string> left;
  for (const auto& entry : fs::directory_iterator(path)) left.push_back(entry.path().filename());
  EXPECT_EQ(left, std::vector<std::string>{"lock"});
}

TEST_F(RunRegistryTest, TheDirectoryOfARunIsPrivate) {
  const Result<RunDirectory> run = RunDirectory::Claim("a");
  struct stat info = {};
  ASSERT_EQ(stat(run->path().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0700u);
}

TEST_F(RunRegistryTest, AFolderOpenToOthersIsRefused) {
  fs::create_directory(folder_ + "/morphbus");
  fs::permissions(folder_ + "/morphbus", fs::perms::all);
  EXPECT_FALSE(RunDirectory::Claim("a").has_value());
}

TEST_F(RunRegistryTest, NamesThatDoNotFitChannelsAreRefused) {
  for (const std::string name : {"a/b", "..", "a b", "a.b", "1234567890123456789012345", "ü"}) {
    const Result<RunDirectory> run = RunDirectory::Claim(name);
    EXPECT_FALSE(run.has_value()) << name;
  }
}

TEST_F(RunRegistryTest, TheOnlyRunNeedsNoName) {
  EXPECT_EQ(FindRun("").error().message,
            "nothing runs here; `morphbus run` in another terminal starts a robot");
  Result<RunDirectory> a = RunDirectory::Claim("a");
  ASSERT_TRUE(a->Publish(Entry("q")).has_value());
  EXPECT_EQ(FindRun("")->name, "a");
  EXPECT_EQ(FindRun("x").error().message, "no run 'x'; running: a");
  Result<RunDirectory> b = RunDirectory::Claim("b");
  ASSERT_TRUE(b->Publish(Entry("q")).has_value());
  EXPECT_EQ(FindRun("").error().message, "several runs; choose one with --run: a, b");
}

}  // namespace
}  // namespace morphbus::tools
