// What the verifier refuses of roles: requirements, labels, inheritance, routines, keywords.

#include <gtest/gtest.h>

#include "test/vm/image_builder.h"
#include "vm/image/image.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {
namespace {

const Code kReturn = Op(Opcode::kReturn);
Code PushInt(int value) { return Op(Opcode::kPushInt8, {value}); }

std::string Verdict(const TestImage& image) { return VerifyMessage(image.Build()); }

// ---- Roles ----

TEST(VerifierTest, RequirementsYieldABoolAndDoNotAct) {
  TestImage image(kReturn);
  image.roles[0].requirements = {0};
  EXPECT_EQ(Verdict(image), "requirement does not yield a bool");
  image.constants = {{ValueType::kBool, 1}};
  image.functions.push_back({"R.require_1",
                             0,
                             ValueType::kBool,
                             0,
                             {},
                             PushInt(1) + Op(Opcode::kIntToFloat) + Op(Opcode::kSleepDs) +
                                 Op16(Opcode::kPushConst, 0) + Op(Opcode::kReturnValue),
                             {}});
  image.roles[0].requirements = {1};
  EXPECT_EQ(Verdict(image), "requirement or label acts on the module");
}

TEST(VerifierTest, RequirementsDoNotActThroughCalls) {
  TestFunction acts;
  acts.code = PushInt(1) + Op(Opcode::kIntToFloat) + Op(Opcode::kSleepDs) + kReturn;
  TestImage image = WithMethod(kReturn, acts);
  image.constants = {{ValueType::kBool, 1}};
  image.functions.push_back(
      {"R.require_1",
       0,
       ValueType::kBool,
       0,
       {},
       Op(Opcode::kCall, {0}) + Op16(Opcode::kPushConst, 0) + Op(Opcode::kReturnValue),
       {}});
  image.roles[0].requirements = {2};
  EXPECT_EQ(Verdict(image), "requirement or label acts on the module");
}

TEST(VerifierTest, LabelsFitTheirFunctions) {
  TestImage image(kReturn);
  image.roles[0].labels = {{ValueType::kJoint, 0}};
  EXPECT_EQ(Verdict(image), "label does not fit its function");
  image.roles[0].labels = {{ValueType::kJoint, 7}};
  EXPECT_EQ(Verdict(image), "label of no function");
}

TestImage WithSubrole() {
  TestImage image(kReturn);
  image.roles[0].fields = {{ValueType::kInt, 1}};
  TestRole sub;
  sub.name = "S";
  sub.parent = 0;
  sub.depth = 1;
  sub.fields = image.roles[0].fields;
  sub.startups = {0};
  image.roles.push_back(sub);
  return image;
}

TEST(VerifierTest, SubrolesAgreeWithTheirBase) {
  EXPECT_EQ(Verdict(WithSubrole()), "");
  TestImage image = WithSubrole();
  image.roles[1].fields[0] = {ValueType::kFloat, 0};
  EXPECT_EQ(Verdict(image), "inherited field differs");
  image.roles[1].fields.clear();
  EXPECT_EQ(Verdict(image), "role lacks members of the role it extends");
  image = WithSubrole();
  image.roles[1].fields[0] = {ValueType::kBool, 2};
  EXPECT_EQ(Verdict(image), "constant is not a value of its type");
}

TEST(VerifierTest, RolesInACircleAreRejected) {
  TestImage image = WithSubrole();
  image.roles[0].parent = 1;
  EXPECT_EQ(Verdict(image), "roles extend each other in a circle");
  image.roles[0].parent = 0;
  EXPECT_EQ(Verdict(image), "roles extend each other in a circle");
  image.roles[0].parent = 2;
  EXPECT_EQ(Verdict(image), "bad head of a role");
}

TEST(VerifierTest, ABaseMayBeDeclaredAfterItsSubrole) {
  TestImage image = WithSubrole();
  std::swap(image.roles[0], image.roles[1]);
  image.roles[0].parent = 1;
  image.functions[0].role = 1;
  EXPECT_EQ(Verdict(image), "");
}

TEST(VerifierTest, FunctionsOfOtherRolesAreRejected) {
  TestImage image = WithSubrole();
  image.functions[0].role = 1;
  EXPECT_EQ(Verdict(image), "role uses a function of an unrelated role");
}

TEST(VerifierTest, RoutinesTakeNoArguments) {
  TestImage image(kReturn);
  image.functions[0].num_arguments = 1;
  image.functions[0].locals = {ValueType::kInt};
  EXPECT_EQ(Verdict(image), "routine has a result or too many arguments");
  image.roles[0].startups.clear();
  image.roles[0].handlers = {{0, 0}};
  EXPECT_EQ(Verdict(image), "handler has a result or arguments that its event has not");
  image.roles[0].handlers = {{9, 0}};
  EXPECT_EQ(Verdict(image), "unknown event");
}

TEST(VerifierTest, KeywordsOfARoleAreFoundInItsCode) {
  TestImage image = WithSubrole();
  image.keywords = {{KeywordKind::kLink, "BAR"}, {KeywordKind::kJoint, "JOINT_1"}};
  TestFunction uses;
  uses.role = 1;
  uses.code = Op(Opcode::kKeyword, {1}) + Op(Opcode::kPop) + kReturn;
  image.functions.push_back(uses);
  image.roles[1].behaviors = {1};
  const std::vector<uint8_t> bytes = image.Build();
  const auto program = std::make_unique<VerifiedProgram>();
  ASSERT_EQ(
      Verifier::Verify(bytes.data(), static_cast<uint32_t>(bytes.size()), program.get()).message,
      nullptr);
  EXPECT_EQ(program->keywords_of_role(0), 0u);
  EXPECT_EQ(program->keywords_of_role(1), 2u);
}

}  // namespace
}  // namespace morphbus::vm
