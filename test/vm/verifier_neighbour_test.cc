// What the verifier lets code ask of neighbours and print, and which handlers it accepts.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/vm/image_builder.h"
#include "vm/image/image.h"
#include "vm/image/print_text.h"
#include "vm/limits.h"

namespace morphbus::vm {
namespace {

const Code kEnd = Op(Opcode::kReturn);
const Code kAll = Op16(Opcode::kPushConst, 0) + Op(Opcode::kConnected);

TestImage WithSharedFields(const Code& code) {
  TestImage image(code);
  image.constants = {{ValueType::kDirection, 0}};
  const auto shared = static_cast<ValueType>(static_cast<int>(ValueType::kFloat) | 0x80);
  image.roles[0].fields = {{ValueType::kInt, 0}, {shared, 0}};
  TestFunction command;
  command.num_arguments = 1;
  command.locals = {ValueType::kInt};
  command.code = kEnd;
  image.functions.push_back(command);
  image.roles[0].commands = {1};
  return image;
}

std::string Check(const Code& code) { return VerifyMessage(WithSharedFields(code).Build()); }

TEST(VerifierNeighbourTest, FieldsMustBeSharedAndExist) {
  const Code pop = Op(Opcode::kPop) + kEnd;
  EXPECT_EQ(Check(kAll + Op(Opcode::kNeighbourField, {0, 1}) + pop), "");
  EXPECT_EQ(Check(kAll + Op(Opcode::kNeighbourField, {0, 0}) + pop), "no such shared field");
  EXPECT_EQ(Check(kAll + Op(Opcode::kNeighbourField, {0, 2}) + pop), "no such shared field");
  EXPECT_EQ(Check(kAll + Op(Opcode::kNeighbourField, {0, 255}) + pop), "no such shared field");
  EXPECT_EQ(Check(kAll + Op(Opcode::kNeighbourField, {1, 1}) + pop), "no such role");
  EXPECT_EQ(Check(Op(Opcode::kNeighbourField, {0, 1}) + pop), "stack underflow");
  EXPECT_EQ(Check(Op(Opcode::kPushInt8, {0}) + Op(Opcode::kNeighbourField, {0, 1}) + pop),
            "operand of the wrong type");
  EXPECT_EQ(Check(kAll + Op(Opcode::kNeighbourField, {0})), "instruction is cut off");
}

TEST(VerifierNeighbourTest, CommandsForNeighboursTakeASetBelowTheArguments) {
  const Code one = Op(Opcode::kPushInt8, {1});
  EXPECT_EQ(Check(kAll + one + Op(Opcode::kInvokeNear, {0, 0}) + kEnd), "");
  EXPECT_EQ(Check(one + kAll + Op(Opcode::kInvokeNear, {0, 0}) + kEnd),
            "operand of the wrong type");
  EXPECT_EQ(Check(one + Op(Opcode::kInvokeNear, {0, 0}) + kEnd), "stack underflow");
  EXPECT_EQ(Check(kAll + one + Op(Opcode::kInvokeNear, {0, 1}) + kEnd), "no such command");
  EXPECT_EQ(Check(kAll + one + Op(Opcode::kInvokeNear, {7, 0}) + kEnd), "no such role");
}

TEST(VerifierNeighbourTest, ARoleSharesFourFieldsAtMostAndAllItInherits) {
  TestImage image = WithSharedFields(kEnd);
  const auto shared = static_cast<ValueType>(static_cast<int>(ValueType::kInt) | 0x80);
  image.roles[0].fields.assign(kMaxSharedFields + 1, {shared, 0});
  EXPECT_EQ(VerifyMessage(image.Build()), "too many shared fields");
  image = WithSharedFields(kEnd);
  TestRole child;
  child.parent = 0;
  child.depth = 1;
  child.fields = {{ValueType::kInt, 0}, {ValueType::kFloat, 0}};
  child.commands = {1};
  image.roles.push_back(child);
  EXPECT_EQ(VerifyMessage(image.Build()), "inherited field differs");
}

// Texts: the builder knows none, but a keyword's name stands at the beginning of the strings.
TestImage Printing(const Code& code, const std::string& text) {
  TestImage image(code);
  image.keywords = {{KeywordKind::kJoint, text}};
  image.constants = {{ValueType::kText, static_cast<uint32_t>(text.size()) << 16},
                     {ValueType::kInt, 3}};
  return image;
}

TEST(VerifierNeighbourTest, PrintTakesTheValuesThatItsTextHasPlacesFor) {
  const Code print = Op16(Opcode::kPrint, 0) + kEnd;
  const Code one = Op(Opcode::kPushInt8, {1});
  const Code real = one + Op(Opcode::kIntToFloat);
  EXPECT_EQ(VerifyMessage(Printing(print, "hello").Build()), "");
  EXPECT_EQ(VerifyMessage(Printing(one + real + print, "{i} and {f} {{").Build()), "");
  EXPECT_EQ(VerifyMessage(Printing(real + one + print, "{i} and {f}").Build()),
            "operand of the wrong type");
  EXPECT_EQ(VerifyMessage(Printing(one + print, "{i} and {f}").Build()),
            "operand of the wrong type");
  EXPECT_EQ(VerifyMessage(Printing(print, "{i}").Build()), "stack underflow");
  EXPECT_EQ(VerifyMessage(Printing(Op16(Opcode::kPrint, 1) + kEnd, "x").Build()), "no such text");
  EXPECT_EQ(VerifyMessage(Printing(Op16(Opcode::kPrint, 2) + kEnd, "x").Build()), "no such text");
  EXPECT_EQ(
      VerifyMessage(Printing(Op16(Opcode::kPushConst, 0) + Op(Opcode::kPop) + kEnd, "x").Build()),
      "a text is no value");
}

TEST(VerifierNeighbourTest, PlacesOfATextAreSound) {
  for (const char* text :
       {"{", "a {", "{i", "{x}", "{s}", "{J}", "{t}", "{}", "{ii}", "{i}{i}{i}{i}{i}{i}{i}"}) {
    EXPECT_EQ(VerifyMessage(Printing(kEnd, text).Build()), "bad place of a value in a text")
        << text;
  }
  TestImage outside = Printing(kEnd, "x");
  outside.constants[0].second = 0x00ffffffu;
  EXPECT_EQ(VerifyMessage(outside.Build()), "text lies outside the strings");
  // A text is no field.
  TestImage field(kEnd);
  field.roles[0].fields = {{ValueType::kText, 0}};
  EXPECT_EQ(VerifyMessage(field.Build()), "field without a first value");
}

TEST(VerifierNeighbourTest, HandlersTakeWhatTheirEventIsAbout) {
  const auto verdict = [](int event, std::vector<ValueType> locals, int arguments = 1,
                          uint32_t period = Bits(0.5f)) {
    TestImage image(kEnd);
    image.constants = {{ValueType::kFloat, period}, {ValueType::kInt, 3}};
    TestFunction handler;
    handler.num_arguments = arguments;
    handler.locals = std::move(locals);
    handler.code = kEnd;
    image.functions.push_back(handler);
    image.roles[0].handlers = {{event, 1}};
    return VerifyMessage(image.Build());
  };
  const std::string wrong = "handler has a result or arguments that its event has not";
  constexpr int kEarly = image::kEarlyBit;
  for (const int early : {0, kEarly}) {
    EXPECT_EQ(verdict(early + 0, {ValueType::kConnector}), "");
    EXPECT_EQ(verdict(early + 1, {ValueType::kConnector}), "");
    EXPECT_EQ(verdict(early + 2, {ValueType::kJoint}), "");
    EXPECT_EQ(verdict(early + 3, {}, 0), "");
    EXPECT_EQ(verdict(early + image::kFirstPeriod, {}, 0), "");
    EXPECT_EQ(verdict(early + 0, {ValueType::kJoint}), wrong);
    EXPECT_EQ(verdict(early + 2, {ValueType::kConnector}), wrong);
    EXPECT_EQ(verdict(early + 3, {ValueType::kConnector}), wrong);
    EXPECT_EQ(verdict(early + image::kFirstPeriod, {ValueType::kJoint}), wrong);
    EXPECT_EQ(verdict(early + 0, {ValueType::kConnector, ValueType::kConnector}, 2), wrong);
    EXPECT_EQ(verdict(early + image::kFirstPeriod + 1, {}, 0), "period of a timer is out of range");
    EXPECT_EQ(verdict(early + image::kFirstPeriod + 2, {}, 0), "unknown event");
    EXPECT_EQ(verdict(early + 127, {}, 0), "unknown event");
  }
  for (const float period : {0.0f, -1.0f, 0.0009f, 1e7f}) {
    EXPECT_EQ(verdict(image::kFirstPeriod, {}, 0, Bits(period)),
              "period of a timer is out of range");
  }
}

}  // namespace
}  // namespace morphbus::vm
