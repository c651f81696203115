#include "vm/image/image.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <utility>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "test/support/source_dir.h"
#include "test/vm/image_builder.h"
#include "vm/image/disassembler.h"
#include "vm/image/opcodes.h"

namespace morphbus::vm {
namespace {

std::string ReadFile(const std::string& path) {
  std::ifstream file(test::SourcePath(path));
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(ImageTest, HashIsFnv1a64WithoutTheHashItself) {
  // Published test vector: FNV-1a-64 of "foobar" is 85944171f73967e8. Spread around the gap.
  std::vector<uint8_t> bytes(image::kHeaderBytes);
  const uint64_t before = image::HashOf(bytes.data(), image::kHeaderBytes);
  for (uint32_t i = 0; i < 8; ++i) bytes[image::kHashAt + i] = 0xff;
  EXPECT_EQ(image::HashOf(bytes.data(), image::kHeaderBytes), before);
  const uint8_t foobar[] = {'f', 'o', 'o', 'b', 'a', 'r'};
  EXPECT_EQ(image::HashOf(foobar, 6), 0x85944171f73967e8u);
}

TEST(ImageTest, BothWritersAgreeOnTheLayout) {
  // The compiler's image of a program, and the same put together by hand.
  const dynarole::CompileResult result = dynarole::CompileProgram(
      "dir/test.dyn", "role R extends Module { startup go() { self.sleepds(1); } }",
      dynarole::TestKeywords());
  ASSERT_TRUE(result.image);
  TestImage image(Op16(Opcode::kPushConst, 0) + Op(Opcode::kSleepDs) + Op(Opcode::kReturn));
  image.constants = {{ValueType::kFloat, Bits(1)}};
  image.lines = {{0, 1}};
  bool ok = false;
  const std::vector<uint8_t> by_hand = image.Build();
  std::string expected =
      DisassembleImage(by_hand.data(), static_cast<uint32_t>(by_hand.size()), &ok);
  EXPECT_TRUE(ok);
  std::string found =
      DisassembleImage(result.image->data(), static_cast<uint32_t>(result.image->size()));
  // Constants stand in another order, and so the hash differs.
  const auto without_header = [](const std::string& text) { return text.substr(text.find('\n')); };
  EXPECT_EQ(without_header(found), without_header(expected));
}

TEST(ImageTest, EqualProgramsGiveEqualImagesWhereverTheyLie) {
  const std::string text = ReadFile("models/programs/quadruped.dyn");
  const auto compile = [&](const std::string& name) {
    return dynarole::CompileProgram(name, text, dynarole::TestKeywords()).image;
  };
  EXPECT_EQ(compile("quadruped.dyn"), compile("/somewhere/else/quadruped.dyn"));
  EXPECT_NE(compile("quadruped.dyn"), compile("other.dyn"));
}

TEST(ImageTest, RefusedImagesAreExplained) {
  const std::vector<uint8_t> image = TestImage(Code{200}).Build();
  bool ok = true;
  const std::string text = DisassembleImage(image.data(), static_cast<uint32_t>(image.size()), &ok);
  EXPECT_FALSE(ok);
  EXPECT_NE(text.find("unknown instruction"), std::string::npos) << text;
}

/// Whether a part names a value, which has a type.
bool NamesAValue(OperandPart part) {
  switch (part) {
    case OperandPart::kConstant:
    case OperandPart::kIntConstant:
    case OperandPart::kLocal:
    case OperandPart::kIntLocal:
    case OperandPart::kStoredLocal:
    case OperandPart::kField:
    case OperandPart::kLocalArray:
    case OperandPart::kFieldArray:
    case OperandPart::kSharedField:
    case OperandPart::kLabel:
    case OperandPart::kPartKeyword:
      return true;
    default:
      return false;
  }
}

/// Whether the operand has one of these parts.
bool Has(const OpcodeInfo& info, std::initializer_list<OperandPart> wanted) {
  const OperandInfo& operand = InfoOf(info.operand);
  return std::ranges::any_of(operand.parts, [&](OperandPart part) {
    return std::find(wanted.begin(), wanted.end(), part) != wanted.end();
  });
}

/// Whether the term is a type, or that of the value which the part that it speaks of names.
bool IsTyped(const OpcodeInfo& info, Term term) {
  if (term.part() >= 0) return NamesAValue(InfoOf(info.operand).parts[term.part()]);
  return term.type() != ValueType::kVoid;
}

/// Whether an instruction may take this term: whether it has the part, routine or text that the
/// term speaks of.
bool MayTake(const OpcodeInfo& info, Term term) {
  switch (term.letter()) {
    case Letter::kArguments:
      return Has(info, {OperandPart::kMethod, OperandPart::kCommand, OperandPart::kSuperFunction});
    case Letter::kPlaces:
      return Has(info, {OperandPart::kText});
    case Letter::kOwnResult:
      return info.flow == Flow::kReturn;
    case Letter::kComparable:
      return info.pops.size() == 2 && info.pops[0].code == info.pops[1].code;
    case Letter::kAny:
      return true;
    default:
      return IsTyped(info, term);
  }
}

/// Whether it may leave this term. What is on the stack at a target only has a type of its own.
bool MayLeave(const OpcodeInfo& info, Term term) {
  if (info.flow == Flow::kKeep) return term.type() != ValueType::kVoid;
  if (term.letter() == Letter::kResult) {
    return Has(info, {OperandPart::kMethod, OperandPart::kSuperFunction});
  }
  return IsTyped(info, term);
}

TEST(OpcodeTableTest, LettersOfSignaturesHaveAMeaning) {
  for (int i = 0; i < kNumOpcodes; ++i) {
    const OpcodeInfo& info = kOpcodes[i];
    for (const Term term : info.pops) {
      EXPECT_TRUE(MayTake(info, term)) << kOpcodeTexts[i].mnemonic << " pops " << term.code;
    }
    for (const Term term : info.pushes) {
      EXPECT_TRUE(MayLeave(info, term)) << kOpcodeTexts[i].mnemonic << " pushes " << term.code;
    }
    EXPECT_GT(info.cost, 0) << kOpcodeTexts[i].mnemonic;
  }
  EXPECT_LE(kNumOpcodes, 256);
  // The letters that are no types have numbers that no type has.
  for (const char letter : {
#define LETTER(name, letter, word) letter,
#include "vm/image/opcodes.def"
#undef LETTER
       }) {
    EXPECT_EQ(TypeOfLetter(letter), ValueType::kVoid) << letter;
    EXPECT_GE(letter, kNumValueTypes) << letter;
  }
}

// The verifier, listings and types of fields look for the role in the byte before.
TEST(OpcodeTableTest, SlotsOfAnotherRoleStandBehindIt) {
  for (const OperandInfo& operand : kOperands) {
    for (int i = 0; i < kMostParts; ++i) {
      const OperandPart part = operand.parts[i];
      if (part != OperandPart::kCommand && part != OperandPart::kSharedField) continue;
      ASSERT_GT(i, 0);
      EXPECT_EQ(operand.parts[i - 1], OperandPart::kRole);
    }
  }
}

TEST(OpcodeTableTest, WhatGoesOnAtATargetHasOneAndNothingElse) {
  for (int i = 0; i < kNumOpcodes; ++i) {
    const OperandInfo& operand = InfoOf(kOpcodes[i].operand);
    const Flow flow = kOpcodes[i].flow;
    EXPECT_EQ(std::count(operand.parts, operand.parts + kMostParts, OperandPart::kTarget),
              flow == Flow::kNext || flow == Flow::kReturn ? 0 : 1)
        << kOpcodeTexts[i].mnemonic;
  }
}

// A jump that compares takes what the comparison takes, at the cost of both.
TEST(OpcodeTableTest, JoinedJumpsAreAComparisonAndAJump) {
  for (const JoinedJump& joined : kJoinedJumps) {
    const OpcodeInfo& jump = InfoOf(joined.jump);
    const OpcodeInfo& comparison = InfoOf(joined.comparison);
    const auto codes = [](const OpcodeInfo& info) {
      return std::pair(info.pops[0].code, info.pops[1].code);
    };
    EXPECT_EQ(codes(jump), codes(comparison));
    EXPECT_EQ(jump.pops.size(), comparison.pops.size());
    EXPECT_EQ(jump.cost, comparison.cost + InfoOf(Opcode::kJumpIfTrue).cost);
    EXPECT_EQ(jump.flow, Flow::kBranch);
  }
}

/// The words of an operand's parts: "local, byte".
std::string OperandWords(OperandKind kind) {
  std::string text;
  for (const OperandPart part : InfoOf(kind).parts) {
    if (part == OperandPart::kNone) break;
    text += (text.empty() ? "" : ", ") + std::string(kPartWords[static_cast<int>(part)].word);
  }
  return text.empty() ? "–" : text;
}

/// What a term of a signature stands for. The type of a part is called by the part: a local's.
std::string TermWord(OperandKind operand, Term term) {
  if (term.part() >= 0) {
    const OperandPart named = InfoOf(operand).parts[term.part()];
    return std::string(kPartWords[static_cast<int>(named)].word) + "'s";
  }
  switch (term.letter()) {
#define LETTER(name, letter, word) \
  case Letter::name:               \
    return word;
#include "vm/image/opcodes.def"
#undef LETTER
  }
  return InfoOf(term.type()).word;
}

/// The words of a signature: "int, int".
template <int kMost>
std::string SignatureText(OperandKind operand, const Terms<kMost>& terms) {
  std::string text;
  for (const Term term : terms) text += (text.empty() ? "" : ", ") + TermWord(operand, term);
  return text.empty() ? "–" : text;
}

/// The instruction set as the table of docs/vm.md, in Markdown.
std::string InstructionTable() {
  // In the order of Effect.
  constexpr const char* kEffects[] = {"pure", "task", "wait"};
  std::string out =
      "| code | instruction | operand | pops | pushes | cost | effect | meaning |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (int i = 0; i < kNumOpcodes; ++i) {
    const OpcodeInfo& info = kOpcodes[i];
    out += fmt::format("| {:02x} | `{}` | {} | ", i, kOpcodeTexts[i].mnemonic,
                       OperandWords(info.operand)) +
           SignatureText(info.operand, info.pops) + " | " +
           SignatureText(info.operand, info.pushes) +
           fmt::format(" | {} | {} | {} |\n", info.cost, kEffects[static_cast<int>(info.effect)],
                       kOpcodeTexts[i].meaning);
  }
  return out;
}

TEST(OpcodeTableTest, DocumentationHasTheTable) {
  const std::string docs = ReadFile("docs/vm.md");
  EXPECT_NE(docs.find(InstructionTable()), std::string::npos)
      << "docs/vm.md must hold this table:\n"
      << InstructionTable();
}

}  // namespace
}  // namespace morphbus::vm
