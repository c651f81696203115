#include "tools/plan/control_script.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace morphbus::tools {
namespace {

namespace fs = std::filesystem;

class ControlScriptTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "script.XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// The error of a folder with this script; empty if it can be read.
  [[nodiscard]] std::string ErrorOfScript(const std::string& text) const {
    std::ofstream(folder_ + "/commands") << text;
    const Result<ControlScript> script = ReadScript(folder_);
    return script ? "" : script.error().message.substr(folder_.size());
  }

  std::string folder_;
};

TEST_F(ControlScriptTest, AScriptIsReadBackAsItWas) {
  ControlScript script;
  script.commands = {{3, *bridge::ParseControl("pause")}, {4, *bridge::ParseControl("step 2")}};
  ASSERT_TRUE(WriteScript(script, folder_));
  const Result<ControlScript> read = ReadScript(folder_);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->commands.size(), 2u);
  EXPECT_EQ(read->commands[1].tick, 4);
  EXPECT_EQ(ControlText(read->commands[1].command), "step 2");
}

TEST_F(ControlScriptTest, NoScriptIsAnEmptyOneButOneThatCannotBeReadIsAnError) {
  EXPECT_TRUE(ReadScript("")) << "the run has no folder";
  const Result<ControlScript> none = ReadScript(folder_);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->commands.empty());
  fs::create_directory(folder_ + "/commands");
  EXPECT_FALSE(ReadScript(folder_));
}

TEST_F(ControlScriptTest, JsonOfOtherTypesIsRefusedWithItsPlace) {
  const std::string expected = "expected an object with a tick, an integer, and a command, a text";
  EXPECT_EQ(ErrorOfScript(R"({"commands":[{"tick":"x"}]})"), "/commands: commands[0]: " + expected);
  EXPECT_EQ(
      ErrorOfScript(R"({"commands":[{"tick":5,"command":"pause"},{"tick":5.5,"command":"stop"}]})"),
      "/commands: commands[1]: " + expected);
  EXPECT_EQ(ErrorOfScript(R"({"commands":[{"tick":5,"command":7}]})"),
            "/commands: commands[0]: " + expected);
  EXPECT_EQ(ErrorOfScript(R"({"commands":[3]})"), "/commands: commands[0]: " + expected);
  EXPECT_EQ(ErrorOfScript(R"({"commands":7})"), "/commands: commands: expected a list");
  EXPECT_EQ(ErrorOfScript(R"({"commands":[{"tick":5,"command":"puase"}]})"),
            "/commands: commands[0]: no command 'puase' (did you mean 'pause'?)");
  EXPECT_EQ(ErrorOfScript(R"({"commands":[{"tick":5,"command":"pause\n6 stop"}]})"),
            "/commands: commands[0]: a command is one line of printable text");
  EXPECT_EQ(ErrorOfScript(R"({"commands":[{"tick":5,"command":"pause"}]})"), "");
}

TEST_F(ControlScriptTest, AModuleThatWasReplacedBeginsAtTheTickThatItBegan) {
  std::ofstream(folder_ + "/commands")
      << "5 pause\n6 restart m3 --cold --from 6\n6 resume\n6 restart m2 --cold --from 5\n";
  const Result<ControlScript> read = ReadScript(folder_);
  ASSERT_TRUE(read) << read.error().message;
  std::string order;
  for (const ScriptedCommand& scripted : read->commands) {
    order += std::to_string(scripted.tick) + " " + ControlText(scripted.command) + "; ";
  }
  EXPECT_EQ(order, "5 pause; 5 restart m2 --cold; 6 restart m3 --cold; 6 resume; ");
}

TEST_F(ControlScriptTest, LinesAreRefusedWithTheirNumber) {
  EXPECT_EQ(ErrorOfScript("5 pause\n\n5pause"),
            "/commands:3: expected a tick, 1 or more, and a command");
  EXPECT_EQ(ErrorOfScript("5 pause\n4 resume"), "/commands:2: ticks must not fall");
  EXPECT_EQ(ErrorOfScript("5 pause # and so on\n"), "");
}

}  // namespace
}  // namespace morphbus::tools
