#include "compiler/source/source_text.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace morphbus::source {
namespace {

TEST(SourceTextTest, LinesAndColumnsCountFromOne) {
  SourceSet set;
  const int file = set.AddText("a", "one\ntwo\n");
  EXPECT_EQ(set.Locate(file, 0).line, 1);
  EXPECT_EQ(set.Locate(file, 0).column, 1);
  EXPECT_EQ(set.Locate(file, 5).line, 2);
  EXPECT_EQ(set.Locate(file, 5).column, 2);
}

TEST(SourceTextTest, ANewlineBelongsToTheLineThatItEnds) {
  SourceSet set;
  const int file = set.AddText("a", "one\ntwo");
  EXPECT_EQ(set.Locate(file, 3).line, 1);
  EXPECT_EQ(set.Locate(file, 3).column, 4);
  EXPECT_EQ(set.LineAt(file, 3), "one");
}

TEST(SourceTextTest, ColumnsCountCharactersNotBytes) {
  SourceSet set;
  const int file = set.AddText("a", "\xC3\xA9\xE2\x82\xAC x");  // é€ x
  EXPECT_EQ(set.Locate(file, 6).column, 4);
}

TEST(SourceTextTest, CarriageReturnsAreNoPartOfALine) {
  SourceSet set;
  const int file = set.AddText("a", "one\r\ntwo\r\n");
  EXPECT_EQ(set.LineAt(file, 0), "one");
  EXPECT_EQ(set.LineAt(file, 5), "two");
}

TEST(SourceTextTest, OffsetsPastTheEndAreTheEnd) {
  SourceSet set;
  const int file = set.AddText("a", "one\n");
  EXPECT_EQ(set.Locate(file, 99).line, 2);
  EXPECT_EQ(set.LineAt(file, 99), "");
  EXPECT_EQ(set.text(Span{file, 2, 99}), "e\n");
  const int empty = set.AddText("b", "");
  EXPECT_EQ(set.Locate(empty, 0).column, 1);
  EXPECT_EQ(set.LineAt(empty, 0), "");
}

TEST(SourceTextTest, MissingFileNamesPathAndReason) {
  SourceSet set;
  const Result<int> file = set.AddFile("no/such/file.m3l");
  ASSERT_FALSE(file.has_value());
  EXPECT_EQ(file.error().message, "cannot read 'no/such/file.m3l': no such file");
}

TEST(SourceTextTest, DirectoriesAndDevicesAreRefused) {
  SourceSet set;
  EXPECT_FALSE(set.AddFile("/").has_value());
  const Result<int> device = set.AddFile("/dev/zero");
  ASSERT_FALSE(device.has_value());
  EXPECT_NE(device.error().message.find("not a regular file"), std::string::npos);
}

TEST(SourceTextTest, FilesAreReadByteForByte) {
  const std::filesystem::path path =
      std::filesystem::path(::testing::TempDir()) / "source_text_test.txt";
  std::ofstream(path, std::ios::binary) << std::string("a\0b\r\n", 5);
  SourceSet set;
  const Result<int> file = set.AddFile(path.string());
  ASSERT_TRUE(file.has_value());
  EXPECT_EQ(set.text(*file), std::string_view("a\0b\r\n", 5));
  EXPECT_EQ(set.name(*file), path.string());
  std::filesystem::remove(path);
}

TEST(SourceTextTest, LinesEndAtNewlinesAndAtCarriageReturns) {
  SourceSet set;
  const int file = set.AddText("mixed", "a\nbc\r\nd\re\r\r\nf");
  const auto place = [&](size_t at) {
    const LineColumn found = set.Locate(file, at);
    return std::pair(found.line, found.column);
  };
  EXPECT_EQ(place(2), std::pair(2, 1));
  EXPECT_EQ(place(6), std::pair(3, 1));
  EXPECT_EQ(place(8), std::pair(4, 1));
  EXPECT_EQ(place(12), std::pair(6, 1));
  EXPECT_EQ(set.LineAt(file, 3), "bc");
  EXPECT_EQ(set.LineAt(file, 6), "d");
  EXPECT_EQ(set.LineAt(file, 8), "e");
}

TEST(SourceTextTest, ViewsStayValidWhenFilesAreAdded) {
  SourceSet set;
  const int file = set.AddText("a", "short");
  const std::string_view view = set.text(file);
  for (int i = 0; i < 100; ++i) set.AddText("b", "x");
  EXPECT_EQ(view.data(), set.text(file).data());
}

}  // namespace
}  // namespace morphbus::source
