// Instructions that the compiler joins into one.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "vm/image/disassembler.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {
namespace {

/// What a startup of this body does last; the instruction must be in its code.
std::string Outcome(const std::string& body, const std::string& instruction) {
  const CompileResult result = CompileProgram(
      "test.dyn", "role Test extends Module { startup go() { " + body + " } }", TestKeywords());
  EXPECT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
  if (!result.image) return "";
  const auto program = std::make_unique<vm::VerifiedProgram>();
  EXPECT_EQ(vm::Verifier::Verify(result.image->data(), static_cast<uint32_t>(result.image->size()),
                                 program.get())
                .message,
            nullptr);
  EXPECT_NE(vm::Disassemble(*program).find(instruction), std::string::npos) << body;
  const std::vector<std::string> events = RunRole(*program, "Test");
  return events.empty() ? "" : events.back();
}

// The remainder by a small number, and the end of a loop that counts up to a constant.
TEST(JoinedInstructionsTest, TheyComputeWhatTheyDidAlone) {
  const auto remainder = [&](const std::string& dividend, const std::string& divisor) {
    return Outcome("var i = " + dividend + "; self.JOINT_1.SET_POSITION(i % " + divisor + ");",
                   "mod_int8");
  };
  EXPECT_EQ(remainder("17", "5"), "position 0 2");
  EXPECT_EQ(remainder("-17", "5"), "position 0 -2");
  EXPECT_EQ(remainder("2000000003", "100"), "position 0 3");
  EXPECT_NE(remainder("17", "0").find("division by zero"), std::string::npos);
  const auto rounds = [&](const std::string& first, const std::string& condition) {
    return Outcome("var n = 0; for (var i = " + first + "; " + condition +
                       "; i += 1) { n += 1; } self.JOINT_1.SET_POSITION(n);",
                   "jump_if_local_less");
  };
  EXPECT_EQ(rounds("0", "i < 300"), "position 0 300");
  EXPECT_EQ(rounds("299", "i < 300"), "position 0 1");
  EXPECT_EQ(rounds("300", "i < 300"), "position 0 0");
  EXPECT_EQ(rounds("-140", "i < -130"), "position 0 10");
  // Of several conditions the last one is joined, the others are not.
  EXPECT_EQ(rounds("0", "n < 7 && i < 300"), "position 0 7");
}

TEST(JoinedInstructionsTest, ConditionsCompareAndJumpAtOnce) {
  const struct {
    const char* condition;
    const char* instruction;
    bool below, same, above;  // Whether it holds if i is less than n, is n, is more.
  } kCases[] = {{"i == n", "jump_unless_equal", false, true, false},
                {"i != n", "jump_unless_not_equal", true, false, true},
                {"!(i == n)", "jump_unless_not_equal", true, false, true},
                {"!(i != n)", "jump_unless_equal", false, true, false},
                {"i < n", "jump_unless_less_int", true, false, false},
                {"i <= n", "jump_unless_less_equal_int", true, true, false},
                {"i > n", "jump_if_less_equal_int", false, false, true},
                {"i >= n", "jump_if_less_int", false, true, true}};
  for (const auto& test : kCases) {
    const bool holds[] = {test.below, test.same, test.above};
    for (int i = 0; i < 3; ++i) {
      const std::string body = "var i = " + std::to_string(i) + "; var n = 1; if (" +
                               test.condition +
                               ") self.JOINT_1.SET_POSITION(1); else self.JOINT_1.SET_POSITION(0);";
      EXPECT_EQ(Outcome(body, std::string(test.instruction) + " "),
                holds[i] ? "position 0 1" : "position 0 0")
          << body;
    }
  }
}

}  // namespace
}  // namespace morphbus::dynarole
