// Parameters: what an image says of them, images with other values, and images that lie.
#include "compiler/dynarole/parameters.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "vm/image/disassembler.h"
#include "vm/image/image.h"
#include "vm/image/verifier.h"

namespace morphbus::dynarole {
namespace {

constexpr std::string_view kProgram = R"(
param swing = 30.0 in [10, 60];
param steps = 4 in [-2, 8];
role Leg extends Module {
  param swing_s = 0.1 in [0.05, 2];
  param steps = 1 in [1, 2];
  startup s() { self.sleepcs(swing + swing_s + steps); }
}
role Arm extends Module {
  param reach = 2.5 in [2, 3];
  startup s() { self.sleepcs(reach + steps); }
}
)";

/// An image that its verified form refers to.
struct Verified {
  explicit Verified(std::string bytes) : image(std::move(bytes)) {
    error = vm::Verifier::Verify(reinterpret_cast<const uint8_t*>(image.data()),
                                 static_cast<uint32_t>(image.size()), program.get());
  }
  std::string image;
  std::unique_ptr<vm::VerifiedProgram> program = std::make_unique<vm::VerifiedProgram>();
  vm::VerifyError error;
};

std::string ImageOf(std::string_view text) {
  const CompileResult result = CompileProgram("test.dyn", std::string(text), TestKeywords());
  EXPECT_TRUE(result.image) << Render(result.diagnostics, result.sources, false);
  return {result.image->begin(), result.image->end()};
}

/// The image with these bytes replaced, and hashes that fit again.
std::string Altered(std::string image, size_t at, uint32_t value) {
  for (int i = 0; i < 4; ++i)
    image[at + static_cast<size_t>(i)] = static_cast<char>(value >> 8 * i);
  auto* bytes = reinterpret_cast<uint8_t*>(image.data());
  const uint32_t run = vm::image::ReadU32(bytes + vm::image::kSizeAt);
  const auto patch = [&](uint32_t place, uint64_t hash) {
    for (int i = 0; i < 8; ++i) bytes[place + static_cast<uint32_t>(i)] = hash >> 8 * i & 0xff;
  };
  patch(vm::image::kNotesHashAt,
        vm::image::HashOfNotes(bytes + run, static_cast<uint32_t>(image.size()) - run));
  patch(vm::image::kHashAt, vm::image::HashOf(bytes, run));
  return image;
}

TEST(ParametersTest, TheImageNamesThemWithValuesAndRanges) {
  const Verified verified(ImageOf(kProgram));
  ASSERT_EQ(verified.error.message, nullptr) << verified.error.message;
  std::vector<std::string> texts;
  for (const ProgramParameter& p : ParametersOf(*verified.program)) {
    texts.push_back(p.name + (p.is_int ? " int " : " float ") + p.Text(p.value) + " in " +
                    p.Text(p.least) + " " + p.Text(p.most));
  }
  // A single of 0.1 is written as in the source, though as a double it has more digits.
  EXPECT_EQ(texts,
            (std::vector<std::string>{"swing float 30 in 10 60", "steps int 4 in -2 8",
                                      "Leg.swing_s float 0.1 in 0.05 2", "Leg.steps int 1 in 1 2",
                                      "Arm.reach float 2.5 in 2 3"}));
  EXPECT_EQ(ParametersText({ParametersOf(*verified.program)[4]}), "Arm.reach 2.5");
  EXPECT_NE(vm::Disassemble(*verified.program).find("parameter Leg.steps in [1, 2]"),
            std::string::npos);
}

TEST(ParametersTest, AnotherValueIsAnotherImageOfTheSameCode) {
  const Verified first(ImageOf(kProgram));
  const auto set = [](const Verified& from, const char* name, const char* value) {
    const Result<std::string> image = WithParameter(*from.program, name, value);
    EXPECT_TRUE(image) << image.error().message;
    return Verified(image.value_or(""));
  };
  const Verified other = set(first, "swing", "45.5");
  ASSERT_EQ(other.error.message, nullptr) << other.error.message;
  EXPECT_NE(other.program->hash(), first.program->hash());
  EXPECT_TRUE(first.program->SameButForParameters(*other.program));
  EXPECT_EQ(ParametersText(ParametersOf(*other.program)).substr(0, 32),
            "swing 45.5 (30 in the source), s");
  // A name without its role is enough where one parameter only has it.
  const Verified reach = set(other, "reach", "3");
  EXPECT_EQ(ParametersOf(*reach.program)[4].value, 3);
  // The way back leads to the same bytes.
  EXPECT_EQ(set(set(reach, "swing", "30"), "Arm.reach", "2.5").image, first.image);
  // Other programs have other code, or other parameters.
  for (const char* text : {"param swing = 30.0 in [10, 61]; role A extends Module {"
                           " startup s() { self.sleepcs(swing); } }",
                           "role A extends Module { startup s() { self.sleepcs(30.0); } }"}) {
    const Verified foreign(ImageOf(text));
    EXPECT_FALSE(first.program->SameButForParameters(*foreign.program)) << text;
  }
}

TEST(ParametersTest, WhatCannotBeSetIsRefusedInASentence) {
  const Verified verified(ImageOf(kProgram));
  const auto refusal = [&](const char* name, const char* value) {
    const Result<std::string> image = WithParameter(*verified.program, name, value);
    return image ? "" : image.error().message;
  };
  EXPECT_EQ(refusal("swing", "60.5"), "parameter swing: 60.5 is out of its range, 10 to 60");
  EXPECT_EQ(refusal("swing", "nan"), "parameter swing: expected a number, 10 to 60, not 'nan'");
  EXPECT_EQ(refusal("steps", "2.5"), "parameter steps: expected an int, -2 to 8, not '2.5'");
  EXPECT_EQ(refusal("Leg.steps", "3"), "parameter Leg.steps: 3 is out of its range, 1 to 2");
  EXPECT_EQ(refusal("swin", "30"), "the program has no parameter 'swin': did you mean 'swing'?");
  EXPECT_EQ(refusal("Arm.reech", "2.5"),
            "the program has no parameter 'Arm.reech': did you mean 'Arm.reach'?");
  const Verified without(ImageOf("role A extends Module { startup s() { self.sleepcs(1); } }"));
  EXPECT_EQ(WithParameter(*without.program, "swing", "1").error().message,
            "there is no parameter 'swing': the program has none (param swing = 30.0 in [10, "
            "60];), or its image has no names for them (compile --strip)");
  const Verified twice(ImageOf(R"(
role A extends Module { param x = 1 in [0, 2]; startup s() { self.sleepcs(x); } }
role B extends Module { param x = 1 in [0, 2]; startup s() { self.sleepcs(x); } })"));
  EXPECT_EQ(WithParameter(*twice.program, "x", "1").error().message,
            "several roles have a parameter 'x': write B.x");
}

TEST(ParametersTest, TheVerifierRefusesValuesOutOfRangeAndRangesThatAreNone) {
  const std::string image = ImageOf(kProgram);
  const auto* bytes = reinterpret_cast<const uint8_t*>(image.data());
  const auto error_of = [](const std::string& altered) {
    const char* message = Verified(altered).error.message;
    return std::string(message == nullptr ? "" : message);
  };
  // The first constant is `swing`; its value stands behind the type.
  const size_t constant = vm::image::SectionOf(bytes, vm::image::Section::kConstants).begin;
  EXPECT_EQ(error_of(Altered(image, constant + 1, vm::Cell::Float(60).bits)), "");
  EXPECT_EQ(error_of(Altered(image, constant + 1, vm::Cell::Float(61).bits)),
            "parameter is out of its range");
  // Its range is the first of five, which the lines follow.
  const uint32_t run = vm::image::ReadU32(bytes + vm::image::kSizeAt);
  const size_t lines =
      size_t{vm::image::ReadU16(bytes + run + vm::image::kNotesLinesAt)} * vm::image::kLineBytes;
  const size_t range = image.size() - lines - 5 * vm::image::kParameterBytes;
  EXPECT_EQ(error_of(Altered(image, range, vm::Cell::Float(5).bits)),
            "parameter is out of its range");
  EXPECT_EQ(error_of(Altered(image, range + 8, 0x7f800000)), "range of a parameter is no number");
  // What is marked as a parameter is a number.
  const uint32_t role = static_cast<uint32_t>(vm::ValueType::kRole) | vm::image::kParameterBit;
  EXPECT_EQ(error_of(Altered(image, constant, role)), "parameter is no number");
}

TEST(ParametersTest, AnImageWithoutNotesKeepsItsValuesButHasNoNamesForThem) {
  const Verified whole(ImageOf(kProgram));
  const Verified stripped(whole.image.substr(0, whole.program->run_size()));
  ASSERT_EQ(stripped.error.message, nullptr) << stripped.error.message;
  EXPECT_TRUE(stripped.program->is_parameter(0));
  EXPECT_EQ(stripped.program->constant(0).AsFloat(), 30);
  EXPECT_TRUE(ParametersOf(*stripped.program).empty());
  EXPECT_NE(vm::Disassemble(*stripped.program).find("parameter 0"), std::string::npos);
}

TEST(ParametersTest, ThereAreAtMostSixtyFour) {
  std::string text;
  for (int i = 0; i < 65; ++i) text += "param p" + std::to_string(i) + " = 1 in [0, 2];\n";
  text += "role A extends Module { startup s() { self.sleepcs(p0); } }";
  const CompileResult result = CompileProgram("test.dyn", text, TestKeywords());
  EXPECT_FALSE(result.image);
  EXPECT_NE(Render(result.diagnostics, result.sources, false).find("too many parameters"),
            std::string::npos);
}

}  // namespace
}  // namespace morphbus::dynarole
