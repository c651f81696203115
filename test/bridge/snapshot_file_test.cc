#include "bridge/module/snapshot_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>

namespace morphbus::bridge {
namespace {

TEST(SnapshotFileTest, KeepsTheNewestWholeSnapshot) {
  const std::string path = testing::TempDir() + "snapshot_" + std::to_string(getpid());
  {
    auto file = SnapshotFile::Open(path);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_TRUE((*file)->Read().empty());
    EXPECT_TRUE((*file)->Write({1, 2, 3}));
    EXPECT_TRUE((*file)->Write({4, 5}));
    EXPECT_EQ((*file)->Read(), (std::vector<uint8_t>{4, 5}));
  }
  auto again = SnapshotFile::Open(path);
  ASSERT_TRUE(again);
  EXPECT_EQ((*again)->Read(), (std::vector<uint8_t>{4, 5}));
  unlink(path.c_str());
  EXPECT_FALSE(SnapshotFile::Open("/nonexistent/snapshot"));
}

TEST(SnapshotFileTest, HasRoomForWhatIsWrittenNextAndGrows) {
  // In memory, as the run's directory mostly is: some disks keep no room for zeros.
  const int memory = memfd_create("snapshot", MFD_CLOEXEC);
  auto file = SnapshotFile::Open("/proc/self/fd/" + std::to_string(memory));
  ASSERT_TRUE(file) << file.error().message;
  const auto room = [memory] {
    struct stat status = {};
    EXPECT_EQ(fstat(memory, &status), 0);
    return static_cast<size_t>(status.st_blocks) * 512;
  };
  // Both slots have theirs before anything is written: no page is missing when it is too late to
  // say so. What the file could grow to it does not take.
  const size_t at_first = room();
  EXPECT_GE(at_first, 2 * SnapshotFile::kRoomBytes);
  EXPECT_LT(at_first, SnapshotFile::kSlotBytes);
  const std::vector<uint8_t> large(5 * SnapshotFile::kRoomBytes, 7);
  EXPECT_TRUE((*file)->Write(large));
  EXPECT_TRUE((*file)->Write({1}));
  EXPECT_TRUE((*file)->Write(large));
  EXPECT_EQ((*file)->Read(), large);
  EXPECT_GE(room(), at_first + 4 * SnapshotFile::kRoomBytes);
  const std::vector<uint8_t> largest(SnapshotFile::kSlotBytes, 8);
  EXPECT_TRUE((*file)->Write(largest));
  EXPECT_EQ((*file)->Read(), largest);
  close(memory);
}

/// Writes the text into the file; false if it cannot.
bool WriteTo(const char* path, const std::string& text) {
  const int fd = open(path, O_WRONLY | O_CLOEXEC);
  const bool written = fd >= 0 && write(fd, text.data(), text.size()) == std::ssize(text);
  if (fd >= 0) close(fd);
  return written;
}

/// Mounts a file system of so many bytes on the folder, for this process alone; false where that
/// is not allowed.
bool MountSmall(const std::string& folder, size_t bytes) {
  const std::string uid = std::to_string(getuid()), gid = std::to_string(getgid());
  if (unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return false;
  WriteTo("/proc/self/setgroups", "deny");
  return WriteTo("/proc/self/uid_map", "0 " + uid + " 1") &&
         WriteTo("/proc/self/gid_map", "0 " + gid + " 1") &&
         mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("none", folder.c_str(), "tmpfs", 0, ("size=" + std::to_string(bytes)).c_str()) == 0;
}

/// Runs the function, in a process of its own, where the folder has only so many bytes of room.
/// Expectations that fail there fail here, too.
void WhereRoomIsShort(size_t bytes, const std::function<void(const std::string& folder)>& run) {
  constexpr int kNoMount = 77;
  const std::string folder = testing::TempDir() + "small_" + std::to_string(getpid());
  std::filesystem::create_directory(folder);
  const pid_t child = fork();
  if (child == 0) {
    if (!MountSmall(folder, bytes)) _exit(kNoMount);
    run(folder);
    _exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  std::filesystem::remove(folder);
  ASSERT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) == kNoMount) GTEST_SKIP() << "a file system cannot be mounted here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(SnapshotFileTest, WhatFindsNoRoomToGrowLeavesTheSnapshotBefore) {
  // Room for what a file has from the start, and not for a slot of five times that.
  WhereRoomIsShort(4 * SnapshotFile::kRoomBytes, [](const std::string& folder) {
    auto file = SnapshotFile::Open(folder + "/m1");
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE((*file)->Write({1, 2, 3}));
    const Result<void> grown = (*file)->Write(std::vector<uint8_t>(5 * SnapshotFile::kRoomBytes));
    ASSERT_FALSE(grown);
    EXPECT_EQ(grown.error().message.find("no room for "), 0u) << grown.error().message;
    EXPECT_NE(grown.error().message.find(folder + "/m1: No space left"), std::string::npos)
        << grown.error().message;
    EXPECT_EQ((*file)->Read(), (std::vector<uint8_t>{1, 2, 3}));
    // What fits is still taken, up to the last byte of the room that the slots have.
    const std::vector<uint8_t> fits(SnapshotFile::kRoomBytes, 9);
    for (int i = 0; i < 2; ++i) EXPECT_TRUE((*file)->Write(fits));
    EXPECT_EQ((*file)->Read(), fits);
  });
}

TEST(SnapshotFileTest, WithoutRoomForTheFirstSnapshotNoFileIsOpened) {
  WhereRoomIsShort(SnapshotFile::kRoomBytes, [](const std::string& folder) {
    const auto file = SnapshotFile::Open(folder + "/m1");
    ASSERT_FALSE(file);
    EXPECT_EQ(file.error().message.find("no room for "), 0u) << file.error().message;
  });
}

}  // namespace
}  // namespace morphbus::bridge
