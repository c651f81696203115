#pragma once
// Assembles one function: bytes, joins, lines, and the types on the stack while they are emitted.

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "compiler/dynarole/codegen.h"
#include "compiler/source/source_text.h"
#include "vm/opcodes.h"

namespace morphbus::dynarole {

/// A place to jump to, before or after it is known.
struct Target {
  bool placed = false;
  uint16_t offset = 0;
  std::vector<size_t> fixups;        ///< Operands that wait for it.
  std::vector<vm::ValueType> stack;  ///< State on the first way there.
};

/// Line numbers of one text, without columns and so in logarithmic time for lines of any length.
class LineTable {
 public:
  explicit LineTable(std::string_view text);
  /// 1-based.
  [[nodiscard]] int LineOf(size_t offset) const;

 private:
  std::vector<size_t> newlines_;
};

class FunctionBuilder {
 public:
  /// `lines` must outlive the builder.
  explicit FunctionBuilder(const LineTable& lines) : lines_(lines) {}

  void Emit(vm::Opcode op) { EmitByte(static_cast<int>(op)); }
  void Emit(vm::Opcode op, int operand);
  void EmitByte(int value) { code_.bytes.push_back(static_cast<uint8_t>(value)); }
  void EmitU16(int value);
  /// Emits an instruction whose signature stands in the table, and its effect on the stack.
  void EmitSimple(vm::Opcode op);
  /// Only the effect on the stack.
  void ApplySignature(vm::Opcode op);
  /// What follows comes from the line in which the span begins.
  void MarkLine(const source::Span& span);

  void Push(vm::ValueType type);
  void Drop(size_t count);
  [[nodiscard]] const std::vector<vm::ValueType>& stack() const { return stack_; }

  /// Emits a jump. A conditional one must have dropped its bool before, except one that it keeps.
  void Jump(vm::Opcode op, Target* target);
  /// The target is here; the code is reachable again if anything leads here. Forward targets that
  /// nothing jumps to are no joins.
  void Place(Target* target, bool is_loop = false);

  /// Locals known to have a value; scopes save and restore it.
  uint16_t set_locals = 0;
  /// False behind a return or an unconditional jump: nothing may be emitted there.
  bool reachable = true;
  /// More operands at a join than an image can state.
  [[nodiscard]] bool too_complex() const { return too_complex_; }

  FunctionCode Finish() { return std::move(code_); }
  [[nodiscard]] size_t size() const { return code_.bytes.size(); }

 private:
  const LineTable& lines_;
  FunctionCode code_;
  std::vector<vm::ValueType> stack_;
  bool too_complex_ = false;
};

}  // namespace morphbus::dynarole
