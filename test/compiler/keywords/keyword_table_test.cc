#include "compiler/keywords/keyword_table.h"

#include <gtest/gtest.h>

#include "compiler/dynarole/compile.h"
#include "compiler/keywords/keywords_xml.h"
#include "vm/image/disassembler.h"

namespace morphbus::keywords {
namespace {

constexpr const char* kLifter = R"(<module version="1" name="Lifter">
  <link name="base" keyword="LINK_BASE"/>
  <link name="fork" keyword="LINK_FORK"/>
  <joint name="lift" keyword="LIFT" type="prismatic"/>
  <connector name="hook" keyword="HOOK">
    <state name="closed" keyword="CLOSED" type="bool"/>
    <state name="mode" keyword="MODE" type="string"><value>slow</value><value>fast</value></state>
  </connector>
</module>
)";

ModuleKeywords Lifter() {
  const Result<ModuleKeywords> keywords = ParseKeywordsXml(kLifter);
  EXPECT_TRUE(keywords) << keywords.error().message;
  return *keywords;
}

/// A program compiled against the keywords of these module types.
dynarole::CompileResult Compile(const std::string& text, const std::vector<ModuleKeywords>& types) {
  return dynarole::CompileProgram("test.dyn", text, *KeywordTable::Of(types));
}

TEST(KeywordTableTest, XmlOfAModuleTypeExtendsTheLanguage) {
  const dynarole::CompileResult result = Compile(R"(
role Lifter extends Module {
  label fork = $LINK_FORK;
  startup go() {
    self.setJointAxis(self.LIFT, fork, $UP_DOWN);
    self.jointMoveMillimetres(self.LIFT, 20);
    self.HOOK.SET_CLOSED(true);
    self.HOOK.SET_MODE(1);
  }
}
)",
                                                 {Lifter()});
  ASSERT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
  const std::string code =
      vm::DisassembleImage(result.image->data(), static_cast<uint32_t>(result.image->size()));
  // Names as the kinematics of the module type have them, in capitals.
  for (const char* line : {"link FORK\n", "joint LIFT\n", "connector HOOK\n", "state CLOSED\n",
                           "state MODE\n", "set_state_bool  CLOSED", "set_state_int   MODE"}) {
    EXPECT_NE(code.find(line), std::string::npos) << line << "\n" << code;
  }
}

TEST(KeywordTableTest, KeywordsOfNoGivenTypeAreErrors) {
  const std::string text = "role A extends Module { label l = $LINK_BAR; }";
  EXPECT_FALSE(Compile(text, {Lifter()}).image);
  ModuleKeywords other;
  other.type_name = "Bar";
  other.links = {{"bar", "LINK_BAR"}};
  const dynarole::CompileResult both = Compile(text, {Lifter(), other});
  EXPECT_TRUE(both.image) << Render(both.diagnostics, both.sources, false);
}

TEST(KeywordTableTest, AStateMayBeABoolInOneTypeAndANumberInAnother) {
  ModuleKeywords other;
  other.type_name = "Other";
  other.connectors = {{"hook", "HOOK", {{"mode", "MODE", {false, true}}}}};
  const dynarole::CompileResult result = Compile(
      "role A extends Module { startup s() { self.HOOK.SET_MODE(1); self.HOOK.SET_MODE(true); } }",
      {Lifter(), other});
  EXPECT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
}

TEST(KeywordTableTest, SixtyFiveModuleTypesAreRefused) {
  EXPECT_TRUE(KeywordTable::Of(std::vector<ModuleKeywords>(64)));
  const Result<KeywordTable> table = KeywordTable::Of(std::vector<ModuleKeywords>(65));
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().message, "a program can know at most 64 module types");
}

}  // namespace
}  // namespace morphbus::keywords
