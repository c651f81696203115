#pragma once
// The instruction set as data, generated from vm/image/opcodes.def.
// The .def file is the only list of instructions: enumerators, operands, costs, listings, the
// verifier's rows and the table in docs/vm.md all come from it.

#include <cstdint>

#include "vm/image/operands.h"
#include "vm/image/values.h"

namespace morphbus::vm {

/// One byte in the code of a function.
enum class Opcode : uint8_t {
#define OP(name, ...) name,
#include "vm/image/opcodes.def"
#undef OP
};

/// How many there are; a byte from here on is no instruction.
inline constexpr int kNumOpcodes = 0
#define OP(name, ...) +1
#include "vm/image/opcodes.def"
#undef OP
    ;

/// What an instruction may do; a function's effect is the strongest of all it may run.
/// Pure instructions only compute, those of a task act on the module, and those that wait may also
/// suspend the task.
enum class Effect : uint8_t { kPure, kTask, kWait };

/// Where a function goes on behind an instruction. Those that do not go on with the next one come
/// last.
enum class Flow : uint8_t {
  /// With the next one; a call returns to it.
  kNext,
  /// With the next one or at the target.
  kBranch,
  /// The same, but what it pushes lies on the stack at the target only.
  kKeep,
  /// At the target.
  kJump,
  /// With the caller. The stack must be empty, and what the instruction pops is the result.
  kReturn,
};

/// The letters of signatures that stand for no type of their own; vm/image/opcodes.def says for
/// what.
enum class Letter : uint8_t {
#define LETTER(name, letter, word) name = letter,
#include "vm/image/opcodes.def"
#undef LETTER
};

/// What one letter of a signature stands for: a type, or what a Letter says. Types have their
/// numbers, which no letter has, so that no letter is looked for among the types at run time.
struct Term {
  /// A ValueType's number, or a letter's character; 0 ends a signature.
  uint8_t code = 0;

  /// The type; kVoid if it is a Letter.
  [[nodiscard]] constexpr ValueType type() const {
    return code < kNumValueTypes ? static_cast<ValueType>(code) : ValueType::kVoid;
  }
  /// The letter, if it is no type.
  [[nodiscard]] constexpr Letter letter() const { return static_cast<Letter>(code); }
  /// The part of the operand (0: the first) whose type it stands for; -1: none.
  [[nodiscard]] constexpr int part() const {
    return letter() == Letter::kFirstPart ? 0 : letter() == Letter::kSecondPart ? 1 : -1;
  }
};

/// Is defined nowhere: a call of it ends the compilation of a table.
void LetterStandsForNothing();

/// Up to so many terms: what an instruction takes or leaves. They take no more room than that; a
/// program of a few kilobytes holds the table.
template <int kMost>
class Terms {
 public:
  /// From a text of so many letters. One that stands for nothing does not compile.
  template <int kSize>
  consteval Terms(const char (&text)[kSize]) {  // NOLINT: the table writes plain texts.
    static_assert(kSize - 1 <= kMost);
    for (int i = 0; i < kSize - 1; ++i) terms_[i] = TermOf(text[i]);
  }
  /// How many there are.
  [[nodiscard]] constexpr int size() const {
    int size = 0;
    while (size < kMost && terms_[size].code != 0) ++size;
    return size;
  }
  /// Term i, and all of them in their order.
  constexpr Term operator[](int i) const { return terms_[i]; }
  [[nodiscard]] constexpr const Term* begin() const { return terms_; }
  [[nodiscard]] constexpr const Term* end() const { return terms_ + size(); }

 private:
  /// What a letter of a signature stands for: one of the table's own letters, else a type's.
  static consteval Term TermOf(char letter) {
    switch (static_cast<Letter>(letter)) {
#define LETTER(name, letter, word) case Letter::name:
#include "vm/image/opcodes.def"
#undef LETTER
      return {static_cast<uint8_t>(letter)};
    }
    const ValueType type = TypeOfLetter(letter);
    if (type == ValueType::kVoid) LetterStandsForNothing();
    return {static_cast<uint8_t>(type)};
  }

  Term terms_[kMost] = {};
};

/// One row of the instruction table, as machines read it: eight bytes.
struct OpcodeInfo {
  /// What the bytes behind the opcode mean.
  OperandKind operand;
  /// What it takes from the stack, deepest first.
  Terms<3> pops;
  /// What it leaves there.
  Terms<2> pushes;
  /// The units of the instruction budget that it costs.
  uint8_t cost;
  /// Where the function goes on.
  Flow flow : 4;
  /// What it may do.
  Effect effect : 4;

  /// Whether the next instruction is never reached from this one.
  [[nodiscard]] constexpr bool ends() const { return flow >= Flow::kJump; }
};

/// The same row as people read it; only listings and docs/vm.md need it.
struct OpcodeText {
  /// The name in listings.
  const char* mnemonic;
  /// The sentence for the table in docs/vm.md.
  const char* meaning;
};

/// The instruction table, by opcode.
inline constexpr OpcodeInfo kOpcodes[kNumOpcodes] = {
#define OP(name, mnemonic, operand, pops, pushes, flow, cost, effect, meaning) \
  {OperandKind::operand, pops, pushes, cost, Flow::flow, Effect::effect},
#include "vm/image/opcodes.def"
#undef OP
};
static_assert(sizeof(OpcodeInfo) == 8);
inline constexpr OpcodeText kOpcodeTexts[kNumOpcodes] = {
#define OP(name, mnemonic, operand, pops, pushes, flow, cost, effect, meaning) {mnemonic, meaning},
#include "vm/image/opcodes.def"
#undef OP
};

/// The row of an opcode.
constexpr const OpcodeInfo& InfoOf(Opcode op) { return kOpcodes[static_cast<int>(op)]; }
/// Whether every build of the virtual machine has the instruction, also that of the small profile.
constexpr bool IsInEveryProfile(Opcode op) {
  return op < Opcode::kExp || (op >= Opcode::kLoadLocalElement && op <= Opcode::kStoreFieldElement);
}

/// A comparison and a jump as one instruction.
struct JoinedJump {
  /// The instruction of the pair as one.
  Opcode jump;
  /// It compares the two values that the jump takes.
  Opcode comparison;
  /// The jump is made if the comparison gives this.
  bool when;
};

/// All of them. Of several rows with one jump the first says which comparison it makes.
inline constexpr JoinedJump kJoinedJumps[] = {
#define JOINED_JUMP(jump, comparison, when) {Opcode::jump, Opcode::comparison, when},
#include "vm/image/opcodes.def"
#undef JOINED_JUMP
};

/// A comparison that a function made: what a requirement measured, and what it wanted.
struct Comparison {
  /// One of kEqual to kLessEqualFloat; kPop if nothing was compared.
  Opcode opcode = Opcode::kPop;
  /// The type of both operands.
  ValueType type = ValueType::kVoid;
  /// What was compared, the left side first.
  Cell left, right;
};

/// What a function compared while it ran.
struct Comparisons {
  /// How many are kept: a requirement seldom compares more.
  static constexpr int kMost = 8;
  /// In order; of more than kMost the first ones, and the last one in the last place.
  Comparison kept[kMost];
  /// How many there were.
  int count = 0;

  /// Keeps one more, in the last place if there is no other.
  void Add(const Comparison& comparison) {
    kept[count < kMost ? count : kMost - 1] = comparison;
    ++count;
  }
  /// How many are in `kept`.
  [[nodiscard]] int num_kept() const { return count < kMost ? count : kMost; }
  /// The one that was made last; its opcode is kPop if there is none.
  [[nodiscard]] Comparison Last() const { return count == 0 ? Comparison() : kept[num_kept() - 1]; }
};

}  // namespace morphbus::vm
