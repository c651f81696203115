// The examples of docs/m3l.md: each fenced block marked m3l compiles.

#include <fstream>
#include <sstream>

#include "compiler/m3l/compile.h"
#include "test/support/diagnostics_test.h"
#include "test/support/source_dir.h"

namespace morphbus::m3l {
namespace {

std::vector<std::string> Examples() {
  std::ifstream file(test::SourcePath("docs/m3l.md"));
  std::vector<std::string> blocks;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (!inside && line == "```m3l") {
      inside = true;
      blocks.emplace_back();
    } else if (inside && line == "```") {
      inside = false;
    } else if (inside) {
      blocks.back() += line + "\n";
    }
  }
  return blocks;
}

/// Compiled as if the example lay beside the models, which it may import.
CompileOutput Compile(const std::string& text) {
  return CompileText(test::SourcePath("models/example.m3l"), text);
}

TEST(DocsTest, EveryExampleCompiles) {
  const std::vector<std::string> examples = Examples();
  EXPECT_GE(examples.size(), 3U);
  for (const std::string& example : examples) {
    const CompileOutput output = Compile(example);
    EXPECT_TRUE(output.model.has_value())
        << source::Render(output.diagnostics, output.sources, false);
  }
}

TEST(DocsTest, TheWorkedExampleHasTheNumbersThatTheTextGives) {
  const CompileOutput output = Compile(Examples().at(0));
  ASSERT_TRUE(output.model.has_value());
  EXPECT_TRUE(output.diagnostics.all().empty());
  const model::ConnectionType& snap = output.model->connection_types.at(0);
  EXPECT_EQ(snap.candidates, 8);
  EXPECT_EQ(snap.options.size(), 4U);
  EXPECT_EQ(snap.options[0].states.at(0).variable, "latched");
  const model::Robot& snake = output.model->robots.at(0);
  EXPECT_EQ(snake.dockings[0].option, 0);
  EXPECT_NE(snake.dockings[1].option, 0);
}

}  // namespace
}  // namespace morphbus::m3l
