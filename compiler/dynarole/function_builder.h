#pragma once
// Assembles one function: bytes, joins, lines, and the types on the stack while they are emitted.

#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "compiler/dynarole/codegen.h"
#include "compiler/source/source_text.h"
#include "vm/image/opcodes.h"

namespace morphbus::dynarole {

/// A place to jump to, before or after it is known.
struct Target {
  /// Its place is known: `offset`.
  bool placed = false;
  uint16_t offset = 0;  ///< In the function, bytes.
  /// Where in the code the operands of jumps stand that wait for the place.
  std::vector<size_t> fixups;
  /// The stack on the first way to the target; every other way must bring the same.
  std::vector<vm::ValueType> stack;
  /// The locals that have a value on every way to the target so far.
  uint16_t set_locals = 0xffff;
};

/// What the letters of an instruction's signature leave open (vm/image/opcodes.def), and what its
/// operand names says.
struct NamedByOperand {
  /// The type of the value that is named, or of the routine's result; kVoid if there is none.
  vm::ValueType type = vm::ValueType::kVoid;
  /// How many values it takes: arguments of the routine, or places of the text.
  size_t values = 0;
};

/// The code of one function while it grows. It knows the types of the operands on the stack at
/// every instruction, as the verifier will find them again.
class FunctionBuilder {
 public:
  /// `sources`, of which the lines of the code are numbered, must outlive the builder.
  explicit FunctionBuilder(const source::SourceSet& sources) : sources_(sources) {}

  /// Emits an instruction with the parts of its operand, and does to the stack and to what follows
  /// as the instruction table says. What stands together may become one instruction (Join).
  void Emit(vm::Opcode op, std::initializer_list<int> parts = {}, const NamedByOperand& named = {});
  /// What follows comes from the line in which the span begins.
  void MarkLine(const source::Span& span);

  /// Types of the operands, the deepest first.
  [[nodiscard]] const std::vector<vm::ValueType>& stack() const { return stack_; }

  /// Emits a jump, with its effect on the stack.
  void Jump(vm::Opcode op, Target* target);
  /// The target is here; the code is reachable again if anything leads here. Forward targets that
  /// nothing jumps to are no joins.
  void Place(Target* target, bool is_loop = false);

  /// Locals known to have a value; scopes save and restore it.
  uint16_t set_locals = 0;
  void SetLocal(int local) { set_locals = static_cast<uint16_t>(set_locals | 1u << local); }
  /// False behind a return or an unconditional jump: nothing may be emitted there.
  bool reachable = true;
  /// Whether some join has more operands than an image can state: what was built is then of no use.
  [[nodiscard]] bool too_complex() const { return too_complex_; }

  /// Hands out what was built; the builder is of no more use.
  FunctionCode Finish() { return std::move(code_); }
  /// Bytes so far.
  [[nodiscard]] size_t size() const { return code_.bytes.size(); }

 private:
  /// The opcode of the last instruction but so many, if it stands directly before and nothing
  /// leads between it and what follows; kReturn, which nothing follows, if there is none.
  [[nodiscard]] vm::Opcode Before(size_t back) const;
  /// Where that instruction begins.
  [[nodiscard]] size_t PlaceOf(size_t back) const { return starts_[starts_.size() - 1 - back]; }
  /// Bytes, without any effect on the stack; numbers are little-endian.
  void EmitOpcode(vm::Opcode op);
  void EmitByte(int value) { code_.bytes.push_back(static_cast<uint8_t>(value)); }
  void EmitNumber(int number, uint32_t bytes);
  /// What an instruction takes from the stack, and what it leaves there.
  void Take(const vm::OpcodeInfo& info, const NamedByOperand& named);
  void Leave(const vm::OpcodeInfo& info, const NamedByOperand& named);
  /// Puts a value of this type on the stack, and keeps count of its greatest height.
  void Push(vm::ValueType type);
  /// Takes so many values off the stack.
  void Drop(size_t count);
  /// Replaces the last instructions by one with these bytes.
  void Replace(size_t count, vm::Opcode op, std::vector<uint8_t> operand);
  /// Joins what has just been emitted with what stands before it, where there is one instruction
  /// for both.
  void Join();
  bool JoinArithmetic(vm::Opcode last);
  /// The instruction that compares as the last one does and jumps as `jump`; `jump` if there is
  /// none.
  [[nodiscard]] vm::Opcode JoinJump(vm::Opcode jump) const;

  const source::SourceSet& sources_;
  FunctionCode code_;
  /// Where instructions begin behind the last place that something may jump to.
  std::vector<size_t> starts_;
  std::vector<vm::ValueType> stack_;
  /// Set once and never taken back; the code generator then reports the routine.
  bool too_complex_ = false;
};

}  // namespace morphbus::dynarole
