#include "tools/base/files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "tools/base/output_path.h"

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

class FilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "files.XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string folder_;
};

TEST_F(FilesTest, WhatIsWrittenIsReadBackByteForByte) {
  std::string bytes;
  for (int i = 0; i < 100000; ++i) bytes.push_back(static_cast<char>(i * 7));
  const std::string path = folder_ + "/a.bin";
  ASSERT_TRUE(WriteFile(path, bytes).has_value());
  const Result<std::string> back = ReadFile(path);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(*back, bytes);
}

TEST_F(FilesTest, NothingButTheFileIsLeftBehind) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", "1").has_value());
  ASSERT_TRUE(WriteFile(folder_ + "/a", "2").has_value());
  int count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_)) ++count;
  EXPECT_EQ(count, 1);
  EXPECT_EQ(*ReadFile(folder_ + "/a"), "2");
}

TEST_F(FilesTest, NewFilesGetTheModeOfTheUmask) {
  const mode_t old = umask(027);
  ASSERT_TRUE(WriteFile(folder_ + "/a", "").has_value());
  umask(old);
  struct stat info = {};
  ASSERT_EQ(stat((folder_ + "/a").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0640u);
}

TEST_F(FilesTest, AMissingFolderIsNamed) {
  const Result<void> result = WriteFile(folder_ + "/none/a", "x");
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().message.find("/none/a: No such file"), std::string::npos)
      << result.error().message;
}

TEST_F(FilesTest, AFailedRenameLeavesTheOldAndNoTemporary) {
  fs::create_directory(folder_ + "/d");
  EXPECT_FALSE(WriteFile(folder_ + "/d", "x").has_value());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(FilesTest, AFileKeepsItsPermissions) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", "1").has_value());
  ASSERT_EQ(chmod((folder_ + "/a").c_str(), 0600), 0);
  ASSERT_TRUE(WriteFile(folder_ + "/a", "2").has_value());
  struct stat info = {};
  ASSERT_EQ(stat((folder_ + "/a").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
}

TEST_F(FilesTest, ALinkStaysALink) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", "1").has_value());
  fs::create_symlink("a", folder_ + "/link");
  ASSERT_TRUE(WriteFile(folder_ + "/link", "2").has_value());
  EXPECT_TRUE(fs::is_symlink(folder_ + "/link"));
  EXPECT_EQ(*ReadFile(folder_ + "/a"), "2");
}

TEST_F(FilesTest, ALinkToNothingYetMakesItsTarget) {
  fs::create_directory(folder_ + "/d");
  fs::create_symlink("d/a", folder_ + "/second");
  fs::create_symlink("second", folder_ + "/link");
  ASSERT_TRUE(WriteFile(folder_ + "/link", "1").has_value());
  EXPECT_TRUE(fs::is_symlink(folder_ + "/link"));
  EXPECT_TRUE(fs::is_symlink(folder_ + "/second"));
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder_ + "/d/a")));
  EXPECT_EQ(*ReadFile(folder_ + "/link"), "1");
}

TEST_F(FilesTest, LinksInACircleAreRefusedAndStay) {
  fs::create_symlink("b", folder_ + "/a");
  fs::create_symlink("a", folder_ + "/b");
  const Result<void> result = WriteFile(folder_ + "/a", "x");
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().message.find("symbolic links"), std::string::npos)
      << result.error().message;
  EXPECT_TRUE(fs::is_symlink(folder_ + "/a"));
}

TEST_F(FilesTest, AStreamOfOurOwnIsWrittenOnFromWhereItIs) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", "old ").has_value());
  const int fd = open((folder_ + "/a").c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  ASSERT_GE(fd, 0);
  fs::create_symlink("/dev/fd/" + std::to_string(fd), folder_ + "/link");
  EXPECT_TRUE(WriteFile("/dev/fd/" + std::to_string(fd), "one ").has_value());
  EXPECT_TRUE(WriteFile("/proc/self/fd/" + std::to_string(fd), "two ").has_value());
  EXPECT_TRUE(WriteFile(folder_ + "/link", "three").has_value());
  close(fd);
  EXPECT_EQ(*ReadFile(folder_ + "/a"), "old one two three");
}

TEST_F(FilesTest, StreamsAreToldFromFiles) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", "").has_value());
  fs::create_symlink("/dev/stdout", folder_ + "/out");
  fs::create_symlink("a", folder_ + "/link");
  ASSERT_EQ(mkfifo((folder_ + "/pipe").c_str(), 0600), 0);
  for (const std::string& stream :
       {std::string("-"), std::string("/dev/stdout"), std::string("/dev/../dev/stderr"),
        std::string("/dev/fd/1"), folder_ + "/out", folder_ + "/pipe"}) {
    EXPECT_TRUE(IsStream(stream)) << stream;
  }
  for (const std::string& file : {folder_ + "/a", folder_ + "/link", folder_ + "/none", folder_}) {
    EXPECT_FALSE(IsStream(file)) << file;
  }
}

TEST_F(FilesTest, AnInputIsKnownByAnyName) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", "").has_value());
  ASSERT_TRUE(WriteFile(folder_ + "/b", "").has_value());
  fs::create_symlink("a", folder_ + "/link");
  const std::vector<std::string> inputs = {folder_ + "/none", folder_ + "/a"};
  EXPECT_TRUE(IsOneOf(folder_ + "/a", inputs));
  EXPECT_TRUE(IsOneOf(folder_ + "/./link", inputs));
  EXPECT_FALSE(IsOneOf(folder_ + "/b", inputs));
  EXPECT_FALSE(IsOneOf(folder_ + "/none", inputs));
  EXPECT_FALSE(IsOneOf("-", inputs));
}

TEST_F(FilesTest, APipeIsWrittenToAndStaysAPipe) {
  const std::string pipe = folder_ + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::string heard;
  std::thread reader([&] { std::getline(std::ifstream(pipe), heard); });
  EXPECT_TRUE(WriteFile(pipe, "words").has_value());
  reader.join();
  EXPECT_EQ(heard, "words");
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST_F(FilesTest, APipeThatNobodyMayEverWriteToIsNotRead) {
  const std::string pipe = folder_ + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const Result<std::string> read = ReadFile(pipe);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("named pipe"), std::string::npos) << read.error().message;
}

TEST_F(FilesTest, FilesOverTheLimitAreRefused) {
  ASSERT_TRUE(WriteFile(folder_ + "/a", std::string(1001, 'x')).has_value());
  EXPECT_TRUE(ReadFile(folder_ + "/a", 1001).has_value());
  EXPECT_FALSE(ReadFile(folder_ + "/a", 1000).has_value());
}

TEST_F(FilesTest, AFolderIsNoFile) { EXPECT_FALSE(ReadFile(folder_).has_value()); }

}  // namespace
}  // namespace morphbus::tools
