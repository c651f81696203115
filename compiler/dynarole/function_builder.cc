#include "compiler/dynarole/function_builder.h"

#include <algorithm>
#include <string_view>

#include "compiler/base/check.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {

void FunctionBuilder::Emit(vm::Opcode op, int operand) {
  Emit(op);
  EmitByte(operand);
}

void FunctionBuilder::EmitU16(int value) {
  EmitByte(value & 255);
  EmitByte(value >> 8);
}

void FunctionBuilder::EmitSimple(vm::Opcode op) {
  Emit(op);
  ApplySignature(op);
}

void FunctionBuilder::ApplySignature(vm::Opcode op) {
  // One letter a type; an instruction pushes one value at most.
  const vm::OpcodeInfo& info = vm::InfoOf(op);
  Drop(std::string_view(info.pops).size());
  if (info.pushes[0] != '\0') Push(vm::TypeOfLetter(info.pushes[0]));
}

void FunctionBuilder::MarkLine(const source::Span& span) {
  // A line is noted once, where its code begins; a line without code leaves no entry.
  const int line = std::min(sources_.LineOf(span.file, span.begin), 65535);
  const auto offset = static_cast<uint32_t>(code_.bytes.size());
  if (!code_.lines.empty() && code_.lines.back().line == line) return;
  if (!code_.lines.empty() && code_.lines.back().offset == offset) code_.lines.pop_back();
  code_.lines.push_back({offset, static_cast<uint16_t>(line)});
}

void FunctionBuilder::Push(vm::ValueType type) {
  stack_.push_back(type);
  code_.max_stack = std::max(code_.max_stack, static_cast<int>(stack_.size()));
}

void FunctionBuilder::Drop(size_t count) {
  // Fewer operands would be a slip of the generator.
  MORPHBUS_CHECK(count <= stack_.size());
  stack_.resize(stack_.size() - count);
}

void FunctionBuilder::Jump(vm::Opcode op, Target* target) {
  Emit(op);
  // Backward jumps know their offset; forward ones are filled in by Place.
  if (target->placed) {
    EmitU16(target->offset);
    return;
  }
  target->stack = stack_;
  target->fixups.push_back(code_.bytes.size());
  EmitU16(0);
}

void FunctionBuilder::Place(Target* target, bool is_loop) {
  target->placed = true;
  target->offset = static_cast<uint16_t>(code_.bytes.size());
  // Without a jump to it the place is no join, and code behind it may be out of reach.
  if (target->fixups.empty() && !is_loop) return;
  // Behind a jump or return, the state is that of the ways that lead here.
  if (!reachable) stack_ = target->stack;
  reachable = true;
  for (const size_t fixup : target->fixups) {
    code_.bytes[fixup] = static_cast<uint8_t>(target->offset & 255);
    code_.bytes[fixup + 1] = static_cast<uint8_t>(target->offset >> 8);
  }
  // Ends of nested branches may meet at one place; what is set on all ways there counts.
  if (!code_.joins.empty() && code_.joins.back().offset == target->offset) {
    code_.joins.back().set_locals &= set_locals;
    return;
  }
  // The image states the types of the operands here, 4 bits each, as far as there is room for them.
  JoinCode join;
  join.offset = target->offset;
  join.set_locals = set_locals;
  too_complex_ = too_complex_ || stack_.size() > vm::image::kMaxJoinDepth;
  for (size_t i = 0; i < std::min<size_t>(stack_.size(), vm::image::kMaxJoinDepth); ++i) {
    join.stack_types |= static_cast<uint32_t>(stack_[i]) << (4 * i);
  }
  code_.joins.push_back(join);
}

}  // namespace morphbus::dynarole
