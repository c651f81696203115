#include "compiler/dynarole/function_builder.h"

#include <algorithm>
#include <cstdint>

#include "compiler/base/check.h"
#include "vm/image/image.h"

namespace morphbus::dynarole {

using vm::Opcode;

void FunctionBuilder::Emit(Opcode op, std::initializer_list<int> parts,
                           const NamedByOperand& named) {
  const vm::OpcodeInfo& info = vm::InfoOf(op);
  EmitOpcode(op);
  // Each part has its width; together they must be what the instruction wants.
  const vm::OperandPart* part = vm::InfoOf(info.operand).parts;
  for (const int number : parts) {
    EmitNumber(number, vm::BytesOf(*part));
    if (*part == vm::OperandPart::kStoredLocal) SetLocal(number);
    ++part;
  }
  MORPHBUS_CHECK(code_.bytes.size() - PlaceOf(0) == 1 + vm::OperandBytes(info.operand));
  Join();
  Take(info, named);
  Leave(info, named);
  if (info.ends()) reachable = false;
}

void FunctionBuilder::EmitOpcode(Opcode op) {
  // Where instructions begin must be known to join them.
  starts_.push_back(code_.bytes.size());
  EmitByte(static_cast<int>(op));
}

void FunctionBuilder::EmitNumber(int number, uint32_t bytes) {
  for (uint32_t i = 0; i < bytes; ++i) EmitByte(number >> (8 * i) & 255);
}

Opcode FunctionBuilder::Before(size_t back) const {
  if (back >= starts_.size()) return Opcode::kReturn;
  return static_cast<Opcode>(code_.bytes[PlaceOf(back)]);
}

void FunctionBuilder::Replace(size_t count, Opcode op, std::vector<uint8_t> operand) {
  // The stack has been accounted for: one instruction does what the several did.
  const size_t begin = PlaceOf(count - 1);
  starts_.resize(starts_.size() - count + 1);
  code_.bytes.resize(begin);
  EmitByte(static_cast<int>(op));
  for (const uint8_t byte : operand) EmitByte(byte);
  // What was in the midst of it belongs to the line in which it begins.
  while (!code_.lines.empty() && code_.lines.back().offset > begin) code_.lines.pop_back();
}

void FunctionBuilder::Join() {
  // What has been joined may be joined again with what comes next.
  const Opcode last = Before(0);
  if (JoinArithmetic(last)) return;
  const auto operand = [this](size_t back, size_t i) { return code_.bytes[PlaceOf(back) + 1 + i]; };
  // Two locals at once, and `x += 3`.
  if (last == Opcode::kLoadLocal && Before(1) == Opcode::kLoadLocal) {
    Replace(2, Opcode::kLoadLocals, {operand(1, 0), operand(0, 0)});
  } else if (last == Opcode::kStoreLocal && Before(1) == Opcode::kAddInt8 &&
             Before(2) == Opcode::kLoadLocal && operand(2, 0) == operand(0, 0)) {
    Replace(3, Opcode::kAddToLocal, {operand(0, 0), operand(1, 0)});
  }
}

bool FunctionBuilder::JoinArithmetic(Opcode last) {
  const Opcode before = Before(1);
  const auto operand = [this](size_t i) { return code_.bytes[PlaceOf(1) + 1 + i]; };
  const bool adds = last == Opcode::kAddInt;
  if (before == Opcode::kPushInt8) {
    const auto number = static_cast<int8_t>(operand(0));
    // A difference is a sum with the opposite, which the lowest byte has not.
    if (last == Opcode::kSubInt && number != INT8_MIN) {
      Replace(2, Opcode::kAddInt8, {static_cast<uint8_t>(-number)});
    } else if (adds || last == Opcode::kMulInt) {
      Replace(2, adds ? Opcode::kAddInt8 : Opcode::kMulInt8, {operand(0)});
    } else if (last == Opcode::kModInt) {
      Replace(2, Opcode::kModInt8, {operand(0)});
    } else {
      return false;
    }
    return true;
  }
  // A constant, and a local, as the second operand.
  if (last == Opcode::kModInt && before == Opcode::kPushConst) {
    Replace(2, Opcode::kModConst, {operand(0), operand(1)});
    return true;
  }
  if (adds && before == Opcode::kLoadLocal) {
    Replace(2, Opcode::kAddLocalInt, {operand(0)});
    return true;
  }
  // Of two locals that were joined the second one is the operand.
  if (adds && before == Opcode::kLoadLocals) {
    const uint8_t first = operand(0), second = operand(1);
    Replace(2, Opcode::kLoadLocal, {first});
    EmitOpcode(Opcode::kAddLocalInt);
    EmitByte(second);
    return true;
  }
  return false;
}

Opcode FunctionBuilder::JoinJump(Opcode jump) const {
  const Opcode when_so = Opcode::kJumpIfTrue, unless = Opcode::kJumpIfFalse;
  for (const vm::JoinedJump& row : vm::kJoinedJumps) {
    if (row.comparison == Before(0) && jump == (row.when ? when_so : unless)) return row.jump;
  }
  return jump;
}

void FunctionBuilder::Take(const vm::OpcodeInfo& info, const NamedByOperand& named) {
  // One value a term, but for those that stand for all that a routine or a text takes.
  for (const vm::Term term : info.pops) {
    const bool several =
        term.letter() == vm::Letter::kArguments || term.letter() == vm::Letter::kPlaces;
    Drop(several ? named.values : 1);
  }
}

void FunctionBuilder::Leave(const vm::OpcodeInfo& info, const NamedByOperand& named) {
  for (const vm::Term term : info.pushes) {
    // What is no type stands for that of what the operand names; a routine may have none.
    const vm::ValueType type = term.type() != vm::ValueType::kVoid ? term.type() : named.type;
    if (type != vm::ValueType::kVoid) Push(type);
  }
}

void FunctionBuilder::MarkLine(const source::Span& span) {
  // A line is noted once, where its code begins; a line without code leaves no entry.
  const int line = std::min(sources_.LineOfAll(span.file, span.begin), 65535);
  const auto offset = static_cast<uint32_t>(code_.bytes.size());
  if (!code_.lines.empty() && code_.lines.back().line == line) return;
  if (!code_.lines.empty() && code_.lines.back().offset == offset) code_.lines.pop_back();
  code_.lines.push_back({offset, static_cast<uint16_t>(line)});
}

void FunctionBuilder::Push(vm::ValueType type) {
  // The image states how high a function's stack grows.
  stack_.push_back(type);
  code_.max_stack = std::max(code_.max_stack, static_cast<int>(stack_.size()));
}

void FunctionBuilder::Drop(size_t count) {
  // Fewer operands would be a slip of the generator.
  MORPHBUS_CHECK(count <= stack_.size());
  stack_.resize(stack_.size() - count);
}

void FunctionBuilder::Jump(vm::Opcode op, Target* target) {
  // A comparison before the jump becomes a part of it, as most jumps have one.
  const vm::OpcodeInfo& info = vm::InfoOf(op);
  const Opcode joined = JoinJump(op);
  // Only loops jump backwards; most of them count up to a constant.
  if (target->placed && joined == Opcode::kJumpIfLessInt && Before(1) == Opcode::kPushConst &&
      Before(2) == Opcode::kLoadLocal) {
    const uint8_t local = code_.bytes[PlaceOf(2) + 1];
    const size_t constant = PlaceOf(1) + 1;
    Replace(3, Opcode::kJumpIfLocalLess, {local, code_.bytes[constant], code_.bytes[constant + 1]});
  } else if (joined != op) {
    Replace(1, joined, {});
  } else {
    EmitOpcode(op);
  }
  Take(info, {});
  Leave(info, {});
  // Backward jumps know their offset; forward ones are filled in by Place.
  if (!target->placed) {
    target->stack = stack_;
    target->set_locals &= set_locals;
    target->fixups.push_back(code_.bytes.size());
  }
  EmitNumber(target->placed ? target->offset : 0, vm::BytesOf(vm::OperandPart::kTarget));
  if (info.flow == vm::Flow::kKeep) Drop(info.pushes.size());
  if (info.ends()) reachable = false;
}

void FunctionBuilder::Place(Target* target, bool is_loop) {
  // What is behind the place is not joined with what is before it.
  starts_.clear();
  target->placed = true;
  target->offset = static_cast<uint16_t>(code_.bytes.size());
  // Without a jump to it the place is no join, and code behind it may be out of reach.
  if (target->fixups.empty() && !is_loop) return;
  // Behind a jump or return, the state is that of the ways that lead here.
  if (!reachable) stack_ = target->stack;
  set_locals &= target->set_locals;
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
