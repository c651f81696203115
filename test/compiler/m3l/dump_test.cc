// The stages of the compiler as text.

#include "compiler/m3l/parser.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "compiler/m3l/compile.h"
#include "compiler/model/model_proto.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

std::string Golden(const std::string& name) {
  std::ifstream file(test::SourcePath("test/compiler/m3l/golden/" + name));
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Dump, StagesAreAsTheyWere) {
  const std::string text = Golden("small.m3l");
  for (const char* stage : {"tokens", "ast"}) {
    const CompileOutput output = CompileText("small.m3l", text, *DumpFromName(stage));
    EXPECT_EQ(output.dump, Golden(std::string("small.") + stage + ".txt")) << stage;
    ASSERT_TRUE(output.model.has_value());
    EXPECT_EQ(model::ModelText(*output.model), Golden("small.model.txt"));
  }
}

TEST(Dump, IsMadeOfTextsWithErrorsToo) {
  EXPECT_EQ(CompileText("x", "link l: mass=", Dump::kTokens).dump,
            "1:1 word link\n1:6 word l\n1:7 symbol :\n1:9 word mass\n1:13 symbol =\n1:14 end\n");
  EXPECT_EQ(CompileText("x", "module M: unit=)", Dump::kAst).dump, "module M (broken)\n  unit=?\n");
}

TEST(Dump, HoldsImportedFilesFirst) {
  const std::string name = test::SourcePath("test/compiler/m3l/golden/x.m3l");
  const std::string dump =
      CompileText(name, "import \"small.m3l\"\nrobot r: modules=(BAR m1)\n", Dump::kAst).dump;
  EXPECT_EQ(dump, Golden("small.ast.txt") +
                      "import \"small.m3l\"\nrobot r\n  modules={tuple {BAR as m1}}\n");
}

TEST(Dump, HasNoOtherStages) {
  EXPECT_FALSE(DumpFromName("code").has_value());
  EXPECT_FALSE(DumpFromName("").has_value());
}

}  // namespace
}  // namespace morphbus::m3l
