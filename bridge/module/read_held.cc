#include "bridge/module/read_held.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "vm/image/image_texts.h"
#include "vm/image/opcodes.h"
#include "vm/image/print_line.h"
#include "vm/image/set_locals.h"

namespace morphbus::bridge {
namespace {

/// A value with its name and type.
HeldValue ToHeld(const vm::VerifiedProgram& program, const vm::VerifiedKinematics& kinematics,
                 const vm::Text& name, vm::ValueType type, vm::Cell value) {
  return {ToString(name), vm::InfoOf(type).word, vm::ValueText(program, &kinematics, type, value)};
}

/// The function of the routine that a task runs, by its place in the role; -1 if the role has no
/// such routine.
int RoutineOf(const vm::RoleInfo& role, const vm::Task& task) {
  // A task is kept by its kind and its place among the role's routines of that kind.
  switch (task.kind) {
    case vm::TaskKind::kStartup:
      return task.index < role.num_startups ? int{role.startups[task.index]} : -1;
    case vm::TaskKind::kBehavior:
      return task.index < role.num_behaviors ? int{role.behaviors[task.index]} : -1;
    case vm::TaskKind::kCommand:
      return task.index < role.num_commands ? int{role.commands[task.index]} : -1;
    case vm::TaskKind::kHandler:
      return task.index < role.num_handlers ? int{role.handlers[task.index].function} : -1;
  }
  return -1;
}

}  // namespace

std::vector<HeldValue> ReadLocals(const vm::VerifiedProgram& program,
                                  const vm::VerifiedKinematics& kinematics, const vm::Frame& call,
                                  uint32_t pc, const vm::Cell* cells) {
  const vm::FunctionInfo function = program.function(call.function);
  // A variable whose assignment has not been reached has no value, whatever its cell holds.
  const unsigned set = vm::SetLocals(program, call.function, pc);
  std::vector<HeldValue> locals;
  for (int i = 0; i < function.num_locals; ++i) {
    locals.push_back(ToHeld(program, kinematics, program.local_name(call.function, i),
                            function.local_types[i], cells[call.base + i]));
    if ((set >> i & 1) == 0) locals.back().value.clear();
  }
  return locals;
}

std::vector<HeldValue> ReadFields(const vm::VerifiedProgram& program,
                                  const vm::VerifiedKinematics& kinematics,
                                  const vm::RoleState& role) {
  std::vector<HeldValue> fields;
  // Fields belong to the role, and there are none before it is taken.
  if (role.role < 0) return fields;
  const vm::RoleInfo info = program.role(role.role);
  for (int f = 0; f < info.num_fields; ++f) {
    fields.push_back(ToHeld(program, kinematics, program.field_name(role.role, f),
                            info.fields.type(f), role.fields[f]));
  }
  return fields;
}

HeldTask ReadTask(const vm::VerifiedProgram& program, const vm::VerifiedKinematics& kinematics,
                  const vm::RoleInfo& role, const vm::Task& task) {
  HeldTask out;
  // What it runs, and what it waits for.
  out.kind = task.kind;
  const int routine = RoutineOf(role, task);
  if (routine >= 0) out.routine = ToString(program.function_name(routine));
  out.wait = task.wait;
  if (task.wait == vm::WaitKind::kSleep) out.until_us = task.wake_us;
  if (task.wait == vm::WaitKind::kMotion) {
    out.joint = ToString(kinematics.joint(task.wait_joint).name);
  }
  // Where it stands. A frame goes on at its pc: what it is at, a wait or a call, is before that.
  for (int f = task.stack.depth - 1; f >= 0; --f) {
    const vm::Frame& frame = task.stack.frames[f];
    const bool innermost = f == task.stack.depth - 1;
    const uint32_t at = innermost ? task.pc : frame.pc - std::min<uint32_t>(frame.pc, 1);
    out.calls.push_back({ToString(program.function_name(frame.function)),
                         program.LineOf(frame.function, at),
                         ReadLocals(program, kinematics, frame, at, task.stack.cells)});
    // What has no value yet is not told.
    std::erase_if(out.calls.back().locals,
                  [](const HeldValue& local) { return local.value.empty(); });
  }
  return out;
}

HeldState ReadHeld(const vm::VerifiedProgram& program, const vm::VerifiedKinematics& kinematics,
                   const vm::VmState& state) {
  HeldState held;
  held.fields = ReadFields(program, kinematics, state.role);
  if (state.role.role < 0) return held;
  const vm::RoleInfo role = program.role(state.role.role);
  // The scheduler has a fixed number of places, of which few are taken.
  for (const vm::Task& task : state.scheduler.tasks) {
    if (task.used) held.tasks.push_back(ReadTask(program, kinematics, role, task));
  }
  return held;
}

}  // namespace morphbus::bridge
