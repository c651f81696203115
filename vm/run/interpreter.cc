#include "vm/run/interpreter.h"

#include <cmath>
#include <cstring>

#include "vm/image/image.h"
#include "vm/image/opcodes.h"

// Dispatch: a table of labels (GCC, clang) branches from the end of each instruction, which
// predicts better than one shared switch; other compilers get the switch. Both come from the same
// handlers.
#if defined(__GNUC__) && !defined(MORPHBUS_VM_SWITCH)
#define MORPHBUS_VM_GOTO 1
#pragma GCC diagnostic ignored "-Wpedantic"
#else
#define MORPHBUS_VM_GOTO 0
#endif

namespace morphbus::vm {
namespace {
// Operands are of the types that the verifier has proved.
float FromCell(Cell cell) { return cell.AsFloat(); }

Direction DirectionOf(Cell cell) { return static_cast<Direction>(cell.bits); }
Axis AxisOf(Cell cell) { return static_cast<Axis>(cell.bits); }

// Tenths or hundredths of a second as microseconds; negative ones are none, absurd ones a century.
int64_t Microseconds(float amount, double unit_us) {
  const double us = static_cast<double>(amount) * unit_us;
  constexpr double kCentury = 3.2e15;
  if (!(us > 0)) return 0;
  return static_cast<int64_t>((us < kCentury ? us : kCentury) + 0.5);
}

// Quotient, rounded toward zero. The lowest integer divided by -1 does not fit.
FaultCode DivideInt(int32_t a, int32_t b, int32_t* result) {
  if (b == 0) return FaultCode::kDivisionByZero;
  if (b == -1)
    return __builtin_sub_overflow(0, a, result) ? FaultCode::kIntegerOverflow : FaultCode::kNone;
  *result = a / b;
  return FaultCode::kNone;
}

// The only member of a mask, or -1.
int OnlyBit(uint32_t mask) {
  return mask != 0 && (mask & (mask - 1)) == 0 ? __builtin_ctz(mask) : -1;
}
}  // namespace

void StartTask(const VerifiedProgram& program, int function, const Cell* arguments, int count,
               TaskState* task) {
  // Every byte is cleared, padding too, so that equal tasks are equal bytes.
  std::memset(static_cast<void*>(task), 0, sizeof(*task));
  // The arguments are the first locals; the others are set before they are read.
  const FunctionInfo& info = program.function(function);
  for (int i = 0; i < count && i < info.num_arguments; ++i) task->cells[i] = arguments[i];
  task->top = info.num_locals;
  task->depth = 1;
  task->frames[0].function = static_cast<uint16_t>(function);
}

RunResult RunTask(const VerifiedProgram& program, const RoleContext& role, ProgramHost& host,
                  TaskState* task, int32_t* budget) {
  // The verifier has proved that no stack bound, slot or target can be wrong; nothing is checked
  // again here but values.
  RunResult result;
  // The frame that runs is kept in local variables and written back when the run ends.
  Frame* frame = &task->frames[task->depth - 1];
  const FunctionInfo* function = &program.function(frame->function);
  const uint8_t* code = program.bytes() + function->code_begin;
  const uint8_t* pc = code + frame->pc;
  const uint8_t* at = pc;  // The instruction that runs.
  Cell* locals = task->cells + frame->base;
  Cell* sp = task->cells + task->top;  // Next free cell.
  // Each instruction takes its cost before it runs; one that cannot pay has not run.
  int32_t budget_left = *budget;
  FaultCode fault = FaultCode::kNone;

#define COST(name) InfoOf(Opcode::name).cost
#if MORPHBUS_VM_GOTO
  static const void* const kHandlers[] = {
#define OP(name, mnemonic, operand, pops, pushes, cost, effect, meaning) &&handle_##name,
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
#define HANDLE(name) \
  case Opcode::name: \
    if ((budget_left -= COST(name)) < 0) goto out_of_budget;
#define DISPATCH_BEGIN \
  dispatch:            \
  at = pc;             \
  switch (static_cast<Opcode>(*pc)) {
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
#define FINISH_FLOAT(value)                                   \
  do {                                                        \
    const float number = (value);                             \
    if (!std::isfinite(number)) FAULT(FaultCode::kNotFinite); \
    REPLACE_TOP(Cell::Float(number));                         \
  } while (false)
// An operation of the host: the operands are popped before `call`, which finds them from sp[0] on,
// and `pc` stands behind the instruction. The frame tells the host which instruction calls, for
// faults that do not end the task.
#define FINISH_EFFECT(operands, length, call)                  \
  do {                                                         \
    sp -= (operands);                                          \
    pc += (length);                                            \
    frame->pc = static_cast<uint32_t>(at - code);              \
    const OpResult effect = (call);                            \
    if (effect.fault != FaultCode::kNone) FAULT(effect.fault); \
    if (effect.wait) goto waiting;                             \
    NEXT();                                                    \
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
  // The arguments on top of the stack become the first locals of the callee.
  HANDLE(kCall) {
    const int callee = program.role(role.role).methods[pc[1]];
    frame->pc = static_cast<uint32_t>(pc + 2 - code);
    function = &program.function(callee);
    locals = sp - function->num_arguments;
    for (Cell* cell = sp; cell < locals + function->num_locals; ++cell) *cell = Cell{};
    sp = locals + function->num_locals;
    frame = &task->frames[task->depth++];
    frame->function = static_cast<uint16_t>(callee);
    frame->base = static_cast<uint16_t>(locals - task->cells);
    pc = code = program.bytes() + function->code_begin;
    NEXT();
  }
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
    FLOAT_OPERATION(std::fmod(a, b));
  }
  HANDLE(kNegFloat) { FINISH_FLOAT(-FromCell(sp[-1])); }
  HANDLE(kIntToFloat) { FINISH_FLOAT(static_cast<float>(sp[-1].AsInt())); }

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

  // Structure.
  HANDLE(kConnected) { REPLACE_TOP(Cell{host.Connected(DirectionOf(sp[-1]))}); }
  HANDLE(kConnectedRole) {
    --sp;
    REPLACE_TOP(Cell{host.ConnectedRole(DirectionOf(sp[-1]), sp[0].AsInt())});
  }
  HANDLE(kCountModules) { REPLACE_TOP(Cell::Int(host.CountModules(sp[-1].bits))); }
  HANDLE(kJoints) {
    --sp;
    REPLACE_TOP(Cell{host.Joints(AxisOf(sp[-1]), sp[0].AsInt())});
  }
  HANDLE(kLinks) { REPLACE_TOP(Cell{host.Links(sp[-1].AsInt())}); }
  // One-member sets become their member; anything else is a fault that says how many there are.
#define ONLY_MEMBER()                                                           \
  do {                                                                          \
    const int only = OnlyBit(sp[-1].bits);                                      \
    if (only < 0) {                                                             \
      result.num_found = static_cast<int16_t>(__builtin_popcount(sp[-1].bits)); \
      FAULT(FaultCode::kUnresolved);                                            \
    }                                                                           \
    REPLACE_TOP(Cell::Int(only));                                               \
  } while (false)
  HANDLE(kOneJoint) { ONLY_MEMBER(); }
  HANDLE(kOneLink) { ONLY_MEMBER(); }
  HANDLE(kCountJoints) { REPLACE_TOP(Cell::Int(__builtin_popcount(sp[-1].bits))); }
  HANDLE(kCountLinks) { REPLACE_TOP(Cell::Int(__builtin_popcount(sp[-1].bits))); }
  HANDLE(kJointAxis) { REPLACE_TOP(Cell::Int(static_cast<int>(host.JointAxis(sp[-1].AsInt())))); }
  // The only one of these that pushes without an operand.
  HANDLE(kCenter) { PUSH(Cell::Int(static_cast<int>(host.CenterAxis())), 1); }

  // Motion, actuators, time, other modules.
  HANDLE(kSetJointAxis) {
    FINISH_EFFECT(3, 1, host.SetJointAxis(sp[0].AsInt(), sp[1].AsInt(), AxisOf(sp[2])));
  }
// A joint and a number are popped and handed to an operation of the host.
#define JOINT_EFFECT(call)                \
  do {                                    \
    const int joint = sp[-2].AsInt();     \
    const float value = FromCell(sp[-1]); \
    FINISH_EFFECT(2, 1, host.call);       \
  } while (false)
  HANDLE(kRotate) { JOINT_EFFECT(RotateDegrees(joint, value, true)); }
  HANDLE(kRotateNonBlocking) { JOINT_EFFECT(RotateDegrees(joint, value, false)); }
  HANDLE(kSetDegrees) { JOINT_EFFECT(SetDegrees(joint, value, true)); }
  HANDLE(kSetDegreesNonBlocking) { JOINT_EFFECT(SetDegrees(joint, value, false)); }
  HANDLE(kTurnContinuous) { JOINT_EFFECT(TurnContinuous(joint, value)); }
  HANDLE(kMoveMillimetres) { JOINT_EFFECT(MoveMillimetres(joint, value)); }
  HANDLE(kSetPosition) { JOINT_EFFECT(SetPosition(joint, value)); }
// A joint becomes its reading; sensors may say anything, so it must be finite.
#define JOINT_READING(call)                                       \
  do {                                                            \
    float degrees = 0;                                            \
    const OpResult reading = host.call(sp[-1].AsInt(), &degrees); \
    if (reading.fault != FaultCode::kNone) FAULT(reading.fault);  \
    FINISH_FLOAT(degrees);                                        \
  } while (false)
  HANDLE(kJointDegrees) { JOINT_READING(JointDegrees); }
  HANDLE(kGetPosition) { JOINT_READING(GetPosition); }
  // The operand says which state variable; a bool is 0 or 1.
  HANDLE(kSetStateBool) {
    FINISH_EFFECT(2, 2, host.SetConnectorState(sp[0].AsInt(), at[1], sp[1]));
  }
  HANDLE(kSetStateInt) { FINISH_EFFECT(2, 2, host.SetConnectorState(sp[0].AsInt(), at[1], sp[1])); }
  HANDLE(kSleepDs) { FINISH_EFFECT(1, 1, host.Sleep(Microseconds(FromCell(sp[0]), 100000))); }
  HANDLE(kSleepCs) { FINISH_EFFECT(1, 1, host.Sleep(Microseconds(FromCell(sp[0]), 10000))); }
  // How many arguments there are is the command's business.
  HANDLE(kInvoke) {
    const int count = program.function(program.role(pc[1]).commands[pc[2]].function).num_arguments;
    FINISH_EFFECT(count, 3, host.Invoke(at[1], at[2], sp, count));
  }
  DISPATCH_END
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
  function = &program.function(frame->function);
  code = program.bytes() + function->code_begin;
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

RunResult Evaluate(const VerifiedProgram& program, int function, const RoleContext& role,
                   ProgramHost& host, int32_t* budget) {
  // Requirements and labels need no task of their own: they never wait.
  TaskState task;
  StartTask(program, function, nullptr, 0, &task);
  RunResult result = RunTask(program, role, host, &task, budget);
  // There is no later tick in which an evaluation could go on.
  if (result.status == RunStatus::kWaiting || result.status == RunStatus::kOutOfBudget) {
    result.status = RunStatus::kFaulted;
    result.fault = FaultCode::kBudget;
  }
  return result;
}

Comparison LastComparison(const VerifiedProgram& program, int function, const RoleContext& role,
                          ProgramHost& host, int32_t budget) {
  Comparison last;
  ValueType pushed = ValueType::kVoid;
  TaskState task;
  StartTask(program, function, nullptr, 0, &task);
  // With no more to spend than an instruction's own cost, nothing runs behind it.
  RunStatus status = RunStatus::kOutOfBudget;
  while (status == RunStatus::kOutOfBudget && budget > 0) {
    const Frame& frame = task.frames[task.depth - 1];
    const uint8_t* at = program.bytes() + program.function(frame.function).code_begin + frame.pc;
    const OpcodeInfo& info = kOpcodes[*at];
    const auto op = static_cast<Opcode>(*at);
    if (op >= Opcode::kEqual && op <= Opcode::kLessEqualFloat) {
      last = {op, pushed, task.cells[task.top - 2], task.cells[task.top - 1]};
    }
    // Both operands are of one type, so that of the second one will do.
    if (op == Opcode::kPushConst) {
      pushed = program.constant_type(image::ReadU16(at + 1));
    } else if (op == Opcode::kLoadField) {
      pushed = program.role(role.role).field_types[at[1]];
    } else if (info.pushes[0] != '\0' && info.pushes[0] != '*') {
      pushed = TypeOfLetter(info.pushes[0]);
    }
    budget -= info.cost;
    int32_t cost = info.cost;
    status = RunTask(program, role, host, &task, &cost).status;
  }
  return last;
}

}  // namespace morphbus::vm
