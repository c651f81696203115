// Calls of what a member replaces: which functions the verifier lets code call without a slot.

#include <gtest/gtest.h>

#include "test/vm/image_builder.h"
#include "vm/limits.h"

namespace morphbus::vm {
namespace {

/// Role 0, role 1 that extends it, role 2 that extends role 1, and role 3 beside them. Functions 0
/// to 3 are their methods in slot 0, and their startups.
TestImage Family() {
  TestImage image;
  image.functions.assign(4, TestFunction{});
  image.roles.assign(4, TestRole{});
  for (int i = 0; i < 4; ++i) {
    image.functions[static_cast<size_t>(i)].role = i;
    image.functions[static_cast<size_t>(i)].code = kLeave;
    TestRole& role = image.roles[static_cast<size_t>(i)];
    role.parent = i == 3 ? -1 : i - 1;
    role.depth = i == 3 ? 0 : i;
    role.methods = {i};
    role.startups = {i};
  }
  return image;
}

Code Super(int function) { return Op16(Opcode::kCallSuper, function); }

TEST(VerifierSuperTest, AFunctionOfARoleAboveMayBeCalled) {
  TestImage image = Family();
  image.functions[2].code = Super(1) + Super(1) + kLeave;
  image.functions[1].code = Super(0) + kLeave;
  EXPECT_EQ(VerifyMessage(image.Build()), "");
}

TEST(VerifierSuperTest, NoOtherMayBeCalled) {
  for (const int callee : {2, 3}) {
    TestImage image = Family();
    image.functions[1].code = Super(callee) + kLeave;
    EXPECT_EQ(VerifyMessage(image.Build()), "function of a role that the own one does not extend");
  }
  TestImage image = Family();
  image.functions[1].code = Super(1) + kLeave;
  EXPECT_EQ(VerifyMessage(image.Build()), "function of a role that the own one does not extend");
  for (const int callee : {4, 511, 65535}) {
    image.functions[1].code = Super(callee) + kLeave;
    EXPECT_EQ(VerifyMessage(image.Build()), "no such function");
  }
  image.functions[2].code = Super(0) + Super(1) + kLeave;
  image.functions[1].code = kLeave;
  EXPECT_EQ(VerifyMessage(image.Build()), "function calls two that it replaces");
}

TEST(VerifierSuperTest, ArgumentsAndResultsFit) {
  TestImage image = Family();
  image.functions[0].num_arguments = 1;
  image.functions[0].locals = {ValueType::kInt};
  image.functions[0].return_type = ValueType::kFloat;
  image.functions[0].code =
      Op(Opcode::kLoadLocal, {0}) + Op(Opcode::kIntToFloat) + Op(Opcode::kReturnValue);
  image.roles[0].startups = {};
  // The other roles have functions of their own in the slot, of the same types.
  for (size_t i : {1, 2, 3}) {
    image.functions.push_back(image.functions[0]);
    image.functions.back().role = static_cast<int>(i);
    image.roles[i].methods = {static_cast<int>(image.functions.size()) - 1};
  }
  const auto verdict = [&image](const Code& code) {
    image.functions[1].code = code;
    return VerifyMessage(image.Build());
  };
  EXPECT_EQ(verdict(Op(Opcode::kPushInt8, {1}) + Super(0) + Op(Opcode::kPop) + kLeave), "");
  EXPECT_EQ(verdict(Super(0) + Op(Opcode::kPop) + kLeave), "stack underflow");
  EXPECT_EQ(verdict(Op(Opcode::kPushInt8, {1}) + Super(0) + kLeave),
            "values left on the stack at return");
  EXPECT_EQ(verdict(Op(Opcode::kPushInt8, {1}) + Op(Opcode::kIntToFloat) + Super(0) +
                    Op(Opcode::kPop) + kLeave),
            "operand of the wrong type");
}

// The base role's function calls the slot, which leads back to the subrole's.
TEST(VerifierSuperTest, CirclesOverASlotAreFound) {
  TestImage image = Family();
  image.functions[1].code = Super(0) + kLeave;
  image.functions[0].code = Op(Opcode::kCall, {0}) + kLeave;
  EXPECT_EQ(VerifyMessage(image.Build()), "functions call each other in a circle");
}

TEST(VerifierSuperTest, DepthCountsWhatIsReplaced) {
  TestImage image;
  const int roles = kMaxCallDepth + 1;
  image.functions.assign(static_cast<size_t>(roles), TestFunction{});
  image.roles.assign(static_cast<size_t>(roles), TestRole{});
  for (int i = 0; i < roles; ++i) {
    const auto at = static_cast<size_t>(i);
    image.functions[at].role = i;
    image.functions[at].code = i > 0 ? Super(i - 1) + kLeave : kLeave;
    image.roles[at].parent = i - 1;
    image.roles[at].depth = i;
    image.roles[at].startups = {i};
  }
  EXPECT_EQ(VerifyMessage(image.Build()), "calls nest too deep");
}

TEST(VerifierSuperTest, ARequirementMayNotActOverIt) {
  TestImage image = Family();
  image.functions[0].code =
      Op(Opcode::kPushInt8, {1}) + Op(Opcode::kIntToFloat) + Op(Opcode::kSleepDs) + kLeave;
  TestFunction requirement;
  requirement.role = 1;
  requirement.return_type = ValueType::kBool;
  requirement.code = Super(0) + Op(Opcode::kPushInt8, {1}) + Op(Opcode::kPushInt8, {1}) +
                     Op(Opcode::kEqual) + Op(Opcode::kReturnValue);
  image.functions.push_back(requirement);
  image.roles[1].requirements = {4};
  EXPECT_EQ(VerifyMessage(image.Build()), "requirement or label acts on the module");
}

}  // namespace
}  // namespace morphbus::vm
