#include "compiler/dynarole/module_keywords.h"

#include <gtest/gtest.h>

#include "compiler/emit/xml.h"
#include "vm/disassembler.h"

namespace morphbus::dynarole {
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

emit::ModuleKeywords Lifter() {
  const Result<emit::ModuleKeywords> keywords = emit::ParseKeywordsXml(kLifter);
  EXPECT_TRUE(keywords) << keywords.error().message;
  return *keywords;
}

TEST(ModuleKeywordsTest, XmlOfAModuleTypeExtendsTheLanguage) {
  const CompileResult result = CompileProgram("lifter.dyn", R"(
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
                                              std::vector<emit::ModuleKeywords>{Lifter()});
  ASSERT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
  const std::string code =
      vm::DisassembleImage(result.image->data(), static_cast<uint32_t>(result.image->size()));
  // Names as the kinematics of the module type have them, in capitals.
  for (const char* line : {"link FORK\n", "joint LIFT\n", "connector HOOK\n", "state CLOSED\n",
                           "state MODE\n", "set_state_bool  CLOSED", "set_state_int   MODE"}) {
    EXPECT_NE(code.find(line), std::string::npos) << line << "\n" << code;
  }
}

TEST(ModuleKeywordsTest, KeywordsOfNoGivenTypeAreErrors) {
  const std::string text = "role A extends Module { label l = $LINK_BAR; }";
  EXPECT_FALSE(CompileProgram("a.dyn", text, std::vector<emit::ModuleKeywords>{Lifter()}).image);
  emit::ModuleKeywords other;
  other.type_name = "Bar";
  other.links = {{"bar", "LINK_BAR"}};
  const CompileResult both =
      CompileProgram("a.dyn", text, std::vector<emit::ModuleKeywords>{Lifter(), other});
  EXPECT_TRUE(both.image) << Render(both.diagnostics, both.sources, false);
}

TEST(ModuleKeywordsTest, AStateMayBeABoolInOneTypeAndANumberInAnother) {
  emit::ModuleKeywords other;
  other.type_name = "Other";
  other.connectors = {{"hook", "HOOK", {{"mode", "MODE", {false, true}}}}};
  const CompileResult result = CompileProgram(
      "a.dyn",
      "role A extends Module { startup s() { self.HOOK.SET_MODE(1); self.HOOK.SET_MODE(true); } }",
      std::vector<emit::ModuleKeywords>{Lifter(), other});
  EXPECT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
}

}  // namespace
}  // namespace morphbus::dynarole
