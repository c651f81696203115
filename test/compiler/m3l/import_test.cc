#include <filesystem>
#include <fstream>

#include "compiler/m3l/compile.h"
#include "test/support/diagnostics_test.h"

namespace morphbus::m3l {
namespace {

constexpr char kModule[] = "module A:\nlink l: mass=1\n";

class ImportTest : public test::DiagnosticsTest {
 protected:
  ImportTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        std::filesystem::path(::testing::TempDir()) / (std::string("m3l_import_") + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "sub");
  }
  ~ImportTest() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  CompileOutput Compile(const std::vector<std::string>& paths) {
    CompileOutput output = CompileFiles(paths);
    Collect(output.diagnostics, output.sources);
    return output;
  }
  std::filesystem::path folder_;
};

TEST_F(ImportTest, PathsAreRelativeToTheImportingFile) {
  Write("sub/module.m3l", kModule);
  Write("sub/middle.m3l", "import \"module.m3l\"\n");
  const std::string top = Write("top.m3l", "import \"sub/middle.m3l\"\nrobot r: modules=(A m1)\n");
  EXPECT_TRUE(Compile({top}).model.has_value());
}

TEST_F(ImportTest, AFileThatIsReachedTwiceCountsOnce) {
  const std::string module = Write("module.m3l", kModule);
  const std::string left = Write("left.m3l", "import \"module.m3l\"\n");
  const std::string right = Write("right.m3l", "import \"sub/../module.m3l\"\n");
  const CompileOutput output = Compile({left, right, module, module});
  ASSERT_TRUE(output.model.has_value());
  EXPECT_EQ(output.model->module_types.size(), 1U);
}

TEST_F(ImportTest, ACycleIsAnErrorThatPointsAtBothPlaces) {
  const std::string a = Write("a.m3l", "import \"b.m3l\"\n");
  Write("b.m3l", "// b\nimport \"a.m3l\"\n");
  EXPECT_FALSE(Compile({a}).model.has_value());
  const source::Diagnostic d = TakeError("import cycle");
  EXPECT_EQ(LineOf(d.span), 2);
  ASSERT_EQ(d.notes.size(), 1U);
  EXPECT_EQ(TextAt(d.notes[0].span), "\"b.m3l\"");
}

TEST_F(ImportTest, DuplicateDefinitionsPointAtBothFiles) {
  const std::string a = Write("a.m3l", kModule);
  const std::string b = Write("b.m3l", kModule);
  EXPECT_FALSE(Compile({a, b}).model.has_value());
  const source::Diagnostic d = TakeError("there is another module 'A'");
  ASSERT_EQ(d.notes.size(), 1U);
  EXPECT_NE(d.span.file, d.notes[0].span.file);
}

TEST_F(ImportTest, MissingFilesAreReportedWhereTheyAreImported) {
  const std::string a = Write("a.m3l", "\nimport \"gone.m3l\"\n");
  EXPECT_FALSE(Compile({a, (folder_ / "lost.m3l").string()}).model.has_value());
  EXPECT_EQ(LineOf(TakeError("gone.m3l': no such file").span), 2);
  EXPECT_EQ(TakeError("lost.m3l': no such file").span.file, -1);
}

TEST_F(ImportTest, FoldersAndDevicesAreNoFiles) {
  const std::string a = Write("a.m3l", "import \"sub\"\nimport \"/dev/zero\"\nimport \"\"\n");
  EXPECT_FALSE(Compile({a}).model.has_value());
  TakeError("sub': not a regular file");
  TakeError("/dev/zero': not a regular file");
  TakeError("this is no file name");
}

TEST_F(ImportTest, ImportsNestToABoundedDepth) {
  for (int i = 0; i < 100; ++i) {
    Write("f" + std::to_string(i) + ".m3l", "import \"f" + std::to_string(i + 1) + ".m3l\"\n");
  }
  EXPECT_FALSE(Compile({(folder_ / "f0.m3l").string()}).model.has_value());
  TakeError("imports nest deeper than 64");
}

}  // namespace
}  // namespace morphbus::m3l
