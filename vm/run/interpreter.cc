#include "vm/run/interpreter.h"

#include "vm/image/image.h"
#include "vm/image/opcodes.h"
#include "vm/image/print_text.h"
#include "vm/run/cells.h"
#include "vm/run/mathematics.h"

// Dispatch: a table of labels (GCC, clang) branches from the end of each instruction, which
// predicts better than one shared switch; other compilers, and builds for which the size counts,
// get the switch. Both come from the same handlers.
#if defined(__GNUC__) && !defined(MORPHBUS_VM_SWITCH)
#define MORPHBUS_VM_GOTO 1
#pragma GCC diagnostic ignored "-Wpedantic"
#else
#define MORPHBUS_VM_GOTO 0
#endif

namespace morphbus::vm {
RunResult RunTask(const VerifiedProgram& program, const RoleContext& role, ProgramHost& host,
                  TaskState* task, int32_t* budget) {
  // The verifier has proved that no stack bound, slot or target can be wrong; nothing is checked
  // again here but values.
  RunResult result;
  // The frame that runs is kept in local variables and written back when the run ends.
  Frame* frame = &task->frames[task->depth - 1];
  const uint8_t* code = program.bytes() + program.function(frame->function).code_begin;
  // Calls go through the slots of the role that is held, which stays the same.
  const ReferenceTable methods = program.role(role.role).methods;
  const uint8_t* pc = code + frame->pc;
  const uint8_t* at = pc;  // The instruction that runs.
  Cell* locals = task->cells + frame->base;
  Cell* sp = task->cells + task->top;  // Next free cell.
  // Each instruction takes its cost before it runs; one that cannot pay has not run.
  int32_t budget_left = *budget;
  FaultCode fault = FaultCode::kNone;

  float real = 0;   // What an instruction leaves that ends at finish_float.
  OpResult effect;  // What the host said of an operation that ends at finish_effect.

#if MORPHBUS_VM_GOTO
#define COST(name) InfoOf(Opcode::name).cost
  static const void* const kHandlers[] = {
#define OP(name, ...) &&handle_##name,
#include "vm/image/opcodes.def"
#undef OP
  };
// Each handler ends with NEXT, which goes to the next instruction's.
#define NEXT()            \
  do {                    \
    at = pc;              \
    goto* kHandlers[*pc]; \
  } while (false)
#define HANDLE(name) handle_##name : if ((budget_left -= COST(name)) < 0) goto out_of_budget;
#define DISPATCH_BEGIN \
  dispatch:            \
  NEXT();
#define DISPATCH_END
#else
#define NEXT() goto dispatch
#define HANDLE(name) case Opcode::name:
#define DISPATCH_BEGIN                                             \
  dispatch:                                                        \
  at = pc;                                                         \
  if ((budget_left -= kOpcodes[*at].cost) < 0) goto out_of_budget; \
  switch (static_cast<Opcode>(*at)) {
#define DISPATCH_END }
#endif
// Ends the task at the instruction that runs.
#define FAULT(code) \
  do {              \
    fault = (code); \
    goto faulted;   \
  } while (false)
// A cell is pushed by an instruction of so many bytes.
#define PUSH(cell, length) \
  do {                     \
    *sp++ = (cell);        \
    pc += (length);        \
    NEXT();                \
  } while (false)
// The top of the stack becomes the result of an instruction of one byte.
#define REPLACE_TOP(cell) \
  do {                    \
    sp[-1] = (cell);      \
    pc += 1;              \
    NEXT();               \
  } while (false)
// The same for a float, which must be finite.
#define FINISH_FLOAT(value) \
  do {                      \
    real = (value);         \
    goto finish_float;      \
  } while (false)
// An operation of the host: the operands are popped before `call`, which finds them from sp[0] on,
// and `pc` stands behind the instruction. The frame tells the host which instruction calls, for
// faults that do not end the task.
#define FINISH_EFFECT(operands, length, call)     \
  do {                                            \
    sp -= (operands);                             \
    pc += (length);                               \
    frame->pc = static_cast<uint32_t>(at - code); \
    effect = (call);                              \
    goto finish_effect;                           \
  } while (false)

  DISPATCH_BEGIN
  // Constants and variables.
  // The operand is signed, so its byte is widened with its sign.
  HANDLE(kPushInt8) { PUSH(Cell::Int(static_cast<int8_t>(pc[1])), 2); }
  HANDLE(kPushConst) { PUSH(program.constant(image::ReadU16(pc + 1)), 3); }
  HANDLE(kLoadLocal) { PUSH(locals[pc[1]], 2); }
  HANDLE(kStoreLocal) {
    locals[pc[1]] = *--sp;
    pc += 2;
    NEXT();
  }
  // A slot holds the same field in every role that extends the function's own.
  HANDLE(kLoadField) { PUSH(role.fields[pc[1]], 2); }
  HANDLE(kStoreField) {
    role.fields[pc[1]] = *--sp;
    pc += 2;
    NEXT();
  }
// The number on the stack is that of one of several cells, which are in `slots` from the first on.
#define ELEMENT(number, slots)                                    \
  if (static_cast<uint32_t>(number) >= pc[2]) {                   \
    result.num_found = number;                                    \
    FAULT(FaultCode::kNoElement);                                 \
  }                                                               \
  Cell& element = (slots)[pc[1] + static_cast<uint32_t>(number)]; \
  pc += 3
  HANDLE(kLoadLocalElement) {
    ELEMENT(sp[-1].AsInt(), locals);
    sp[-1] = element;
    NEXT();
  }
  HANDLE(kStoreLocalElement) {
    ELEMENT(sp[-2].AsInt(), locals);
    element = sp[-1];
    sp -= 2;
    NEXT();
  }
  HANDLE(kLoadFieldElement) {
    ELEMENT(sp[-1].AsInt(), role.fields);
    sp[-1] = element;
    NEXT();
  }
  HANDLE(kStoreFieldElement) {
    ELEMENT(sp[-2].AsInt(), role.fields);
    element = sp[-1];
    sp -= 2;
    NEXT();
  }
  // A label of the role held always resolves; while a role is being decided it may not.
  HANDLE(kLoadLabel) {
    const int index = role.labels[pc[1]];
    if (index < 0) FAULT(FaultCode::kUnresolved);
    PUSH(Cell::Int(index), 2);
  }
  // Keywords are bound by the host, which knows the module type.
  HANDLE(kKeyword) {
    const int index = host.Keyword(pc[1]);
    if (index < 0) {
      result.keyword = pc[1];
      FAULT(FaultCode::kMissingKeyword);
    }
    PUSH(Cell::Int(index), 2);
  }
  HANDLE(kPop) {
    --sp;
    pc += 1;
    NEXT();
  }

  // Control.
  HANDLE(kJump) {
    pc = code + image::ReadU16(pc + 1);
    NEXT();
  }
  // Targets are byte offsets in the function, which the verifier has found to be instructions.
  HANDLE(kJumpIfFalse) {
    pc = (--sp)->AsBool() ? pc + 3 : code + image::ReadU16(pc + 1);
    NEXT();
  }
  HANDLE(kJumpIfTrue) {
    pc = (--sp)->AsBool() ? code + image::ReadU16(pc + 1) : pc + 3;
    NEXT();
  }
  // `and` and `or` keep an operand that decides alone as the result, and else go on without it.
  HANDLE(kAnd) {
    if (sp[-1].AsBool()) {
      --sp;
      pc += 3;
    } else {
      pc = code + image::ReadU16(pc + 1);
    }
    NEXT();
  }
  HANDLE(kOr) {
    if (sp[-1].AsBool()) {
      pc = code + image::ReadU16(pc + 1);
    } else {
      --sp;
      pc += 3;
    }
    NEXT();
  }
// The arguments on top of the stack become the first locals of the callee; the instruction has so
// many bytes.
#define ENTER(number, length)                                                          \
  do {                                                                                 \
    const int callee = (number);                                                       \
    frame->pc = static_cast<uint32_t>(pc + (length)-code);                             \
    const FunctionInfo function = program.function(callee);                            \
    locals = sp - function.num_arguments;                                              \
    for (Cell* cell = sp; cell < locals + function.num_locals; ++cell) *cell = Cell{}; \
    sp = locals + function.num_locals;                                                 \
    frame = &task->frames[task->depth++];                                              \
    frame->function = static_cast<uint16_t>(callee);                                   \
    frame->base = static_cast<uint16_t>(locals - task->cells);                         \
    pc = code = program.bytes() + function.code_begin;                                 \
    NEXT();                                                                            \
  } while (false)
  HANDLE(kCall) { ENTER(methods[pc[1]], 2); }
  HANDLE(kCallSuper) { ENTER(image::ReadU16(pc + 1), 3); }
  // The callee's cells go; a result takes the place of the arguments.
  HANDLE(kReturn) {
    sp = locals;
    goto returned;
  }
  HANDLE(kReturnValue) {
    const Cell value = sp[-1];
    sp = locals;
    if (task->depth == 1) {
      result.value = value;
    } else {
      *sp++ = value;
    }
    goto returned;
  }

  // Integers.
// Two operands become one result, unless it does not fit into 32 bits.
#define INT_OPERATION(builtin)                                                                \
  do {                                                                                        \
    int32_t number;                                                                           \
    if (builtin(sp[-2].AsInt(), sp[-1].AsInt(), &number)) FAULT(FaultCode::kIntegerOverflow); \
    --sp;                                                                                     \
    REPLACE_TOP(Cell::Int(number));                                                           \
  } while (false)
  HANDLE(kAddInt) { INT_OPERATION(__builtin_add_overflow); }
  HANDLE(kSubInt) { INT_OPERATION(__builtin_sub_overflow); }
  HANDLE(kMulInt) { INT_OPERATION(__builtin_mul_overflow); }
  HANDLE(kDivInt) {
    int32_t number = 0;
    const FaultCode code_or_none = DivideInt(sp[-2].AsInt(), sp[-1].AsInt(), &number);
    if (code_or_none != FaultCode::kNone) FAULT(code_or_none);
    --sp;
    REPLACE_TOP(Cell::Int(number));
  }
  // The lowest integer modulo -1 is 0, though the quotient does not fit.
  HANDLE(kModInt) {
    const int32_t divisor = sp[-1].AsInt();
    if (divisor == 0) FAULT(FaultCode::kDivisionByZero);
    --sp;
    REPLACE_TOP(Cell::Int(divisor == -1 ? 0 : sp[-1].AsInt() % divisor));
  }
  HANDLE(kMinInt) {
    --sp;
    REPLACE_TOP(Cell::Int(sp[0].AsInt() < sp[-1].AsInt() ? sp[0].AsInt() : sp[-1].AsInt()));
  }
  HANDLE(kMaxInt) {
    --sp;
    REPLACE_TOP(Cell::Int(sp[0].AsInt() > sp[-1].AsInt() ? sp[0].AsInt() : sp[-1].AsInt()));
  }
  HANDLE(kNegInt) {
    int32_t number;
    if (__builtin_sub_overflow(0, sp[-1].AsInt(), &number)) FAULT(FaultCode::kIntegerOverflow);
    REPLACE_TOP(Cell::Int(number));
  }

  // Floats.
// Two operands a and b become one result, which must be finite.
#define FLOAT_OPERATION(expression)                         \
  do {                                                      \
    const float a = FromCell(sp[-2]), b = FromCell(sp[-1]); \
    --sp;                                                   \
    FINISH_FLOAT(expression);                               \
  } while (false)
  HANDLE(kAddFloat) { FLOAT_OPERATION(a + b); }
  HANDLE(kSubFloat) { FLOAT_OPERATION(a - b); }
  HANDLE(kMulFloat) { FLOAT_OPERATION(a * b); }
  HANDLE(kDivFloat) {
    if (FromCell(sp[-1]) == 0) FAULT(FaultCode::kDivisionByZero);
    FLOAT_OPERATION(a / b);
  }
  HANDLE(kModFloat) {
    if (FromCell(sp[-1]) == 0) FAULT(FaultCode::kDivisionByZero);
    FLOAT_OPERATION(Modulo(a, b));
  }
  HANDLE(kNegFloat) { FINISH_FLOAT(-FromCell(sp[-1])); }
  HANDLE(kIntToFloat) { FINISH_FLOAT(static_cast<float>(sp[-1].AsInt())); }

  // Mathematics, of one number and of two.
  HANDLE(kSin) { goto function_of_one; }
  HANDLE(kCos) { goto function_of_one; }
  HANDLE(kTan) { goto function_of_one; }
  HANDLE(kAsin) { goto function_of_one; }
  HANDLE(kAcos) { goto function_of_one; }
  HANDLE(kAtan2) { goto function_of_two; }
  HANDLE(kSqrt) { goto function_of_one; }
  HANDLE(kAbs) { goto function_of_one; }
  HANDLE(kMin) { goto function_of_two; }
  HANDLE(kMax) { goto function_of_two; }
  HANDLE(kFloor) { goto function_of_one; }
  HANDLE(kRound) { goto function_of_one; }
  HANDLE(kSign) { goto function_of_one; }
  HANDLE(kExp) { goto function_of_one; }
  HANDLE(kLog) { goto function_of_one; }
  HANDLE(kPow) { goto function_of_two; }
  HANDLE(kFloatToInt) {
    int32_t number = 0;
    if (!ToInt(FromCell(sp[-1]), &number)) FAULT(FaultCode::kIntegerOverflow);
    REPLACE_TOP(Cell::Int(number));
  }
  // Each draw is another number, so that it comes from the host.
  HANDLE(kRandom) { FLOAT_OPERATION(a + (b - a) * host.Random()); }

  // Comparisons and logic.
// Two operands become a bool.
#define COMPARISON(left, comparison, right)     \
  do {                                          \
    const bool holds = (left)comparison(right); \
    --sp;                                       \
    REPLACE_TOP(Cell::Bool(holds));             \
  } while (false)
  // Bools, ints and indices are equal if their bits are.
  HANDLE(kEqual) { COMPARISON(sp[-2].bits, ==, sp[-1].bits); }
  HANDLE(kNotEqual) { COMPARISON(sp[-2].bits, !=, sp[-1].bits); }
  HANDLE(kLessInt) { COMPARISON(sp[-2].AsInt(), <, sp[-1].AsInt()); }
  HANDLE(kLessEqualInt) { COMPARISON(sp[-2].AsInt(), <=, sp[-1].AsInt()); }
  HANDLE(kEqualFloat) { COMPARISON(FromCell(sp[-2]), ==, FromCell(sp[-1])); }
  HANDLE(kLessFloat) { COMPARISON(FromCell(sp[-2]), <, FromCell(sp[-1])); }
  HANDLE(kLessEqualFloat) { COMPARISON(FromCell(sp[-2]), <=, FromCell(sp[-1])); }
  HANDLE(kNot) { REPLACE_TOP(Cell::Bool(!sp[-1].AsBool())); }

  // What the host answers: directions, structure, motion, sensors, time, other modules.
#include "vm/run/robot_handlers.inc"

  // Several as one.
  HANDLE(kLoadLocals) {
    sp[0] = locals[pc[1]];
    sp[1] = locals[pc[2]];
    sp += 2;
    pc += 3;
    NEXT();
  }
// The top and another integer become one result, by an instruction of so many bytes.
#define TOP_OPERATION(builtin, operand, length)                                        \
  do {                                                                                 \
    int32_t number;                                                                    \
    if (builtin(sp[-1].AsInt(), operand, &number)) FAULT(FaultCode::kIntegerOverflow); \
    sp[-1] = Cell::Int(number);                                                        \
    pc += (length);                                                                    \
    NEXT();                                                                            \
  } while (false)
  HANDLE(kAddLocalInt) { TOP_OPERATION(__builtin_add_overflow, locals[pc[1]].AsInt(), 2); }
  HANDLE(kAddInt8) { TOP_OPERATION(__builtin_add_overflow, static_cast<int8_t>(pc[1]), 2); }
  HANDLE(kMulInt8) { TOP_OPERATION(__builtin_mul_overflow, static_cast<int8_t>(pc[1]), 2); }
// The top becomes its remainder by another integer, by an instruction of so many bytes.
#define TOP_REMAINDER(operand, length)                                \
  do {                                                                \
    const int32_t divisor = (operand);                                \
    if (divisor == 0) FAULT(FaultCode::kDivisionByZero);              \
    sp[-1] = Cell::Int(divisor == -1 ? 0 : sp[-1].AsInt() % divisor); \
    pc += (length);                                                   \
    NEXT();                                                           \
  } while (false)
  HANDLE(kModConst) { TOP_REMAINDER(program.constant(image::ReadU16(pc + 1)).AsInt(), 3); }
  HANDLE(kModInt8) { TOP_REMAINDER(static_cast<int8_t>(pc[1]), 2); }
  HANDLE(kAddToLocal) {
    int32_t number;
    if (__builtin_add_overflow(locals[pc[1]].AsInt(), static_cast<int8_t>(pc[2]), &number)) {
      FAULT(FaultCode::kIntegerOverflow);
    }
    locals[pc[1]] = Cell::Int(number);
    pc += 3;
    NEXT();
  }
// Two operands are compared, and decide whether the next instruction is the target.
#define COMPARE_AND_JUMP(condition)                            \
  do {                                                         \
    sp -= 2;                                                   \
    pc = (condition) ? code + image::ReadU16(pc + 1) : pc + 3; \
    NEXT();                                                    \
  } while (false)
  HANDLE(kJumpUnlessEqual) { COMPARE_AND_JUMP(sp[0].bits != sp[1].bits); }
  HANDLE(kJumpUnlessNotEqual) { COMPARE_AND_JUMP(sp[0].bits == sp[1].bits); }
  HANDLE(kJumpUnlessLessInt) { COMPARE_AND_JUMP(sp[0].AsInt() >= sp[1].AsInt()); }
  HANDLE(kJumpUnlessLessEqualInt) { COMPARE_AND_JUMP(sp[0].AsInt() > sp[1].AsInt()); }
  HANDLE(kJumpIfLessInt) { COMPARE_AND_JUMP(sp[0].AsInt() < sp[1].AsInt()); }
  HANDLE(kJumpIfLessEqualInt) { COMPARE_AND_JUMP(sp[0].AsInt() <= sp[1].AsInt()); }
  HANDLE(kJumpIfLocalLess) {
    const int32_t bound = program.constant(image::ReadU16(pc + 2)).AsInt();
    pc = locals[pc[1]].AsInt() < bound ? code + image::ReadU16(pc + 4) : pc + 6;
    NEXT();
  }
  DISPATCH_END
// How several instructions end.
function_of_one:
  real = Mathematics(static_cast<Opcode>(*at), FromCell(sp[-1]), 0);
  goto finish_float;
function_of_two:
  --sp;
  real = Mathematics(static_cast<Opcode>(*at), FromCell(sp[-1]), FromCell(sp[0]));
finish_float:
  if (!IsFinite(real)) FAULT(FaultCode::kNotFinite);
  REPLACE_TOP(Cell::Float(real));
finish_effect:
  if (effect.fault != FaultCode::kNone) FAULT(effect.fault);
  if (effect.wait) goto waiting;
  NEXT();

// A function has returned: to its caller's next instruction, or the task is at its end.
returned:
  if (--task->depth == 0) {
    result.status = RunStatus::kFinished;
    result.function = frame->function;
    result.pc = static_cast<uint32_t>(at - code);
    task->top = 0;
    *budget = budget_left;
    return result;
  }
  // The caller goes on behind its call, with its own locals.
  --frame;
  code = program.bytes() + program.function(frame->function).code_begin;
  pc = code + frame->pc;
  locals = task->cells + frame->base;
  goto dispatch;

out_of_budget:
  budget_left += kOpcodes[*at].cost;  // It has not run.
  result.status = RunStatus::kOutOfBudget;
  goto leave;
waiting:
  result.status = RunStatus::kWaiting;
  goto leave;
faulted:
  result.status = RunStatus::kFaulted;
  result.fault = fault;
  goto leave;

// Whatever ended the run, the task keeps where it stands. The place reported is the instruction's
// own.
leave:
  result.function = frame->function;
  result.pc = static_cast<uint32_t>(at - code);
  frame->pc = static_cast<uint32_t>(pc - code);
  task->top = static_cast<uint16_t>(sp - task->cells);
  *budget = budget_left;
  return result;
}

}  // namespace morphbus::vm
