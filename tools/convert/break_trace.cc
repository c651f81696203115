#include "tools/convert/break_trace.h"

#include <fmt/format.h>

#include "bridge/module/read_held.h"
#include "compiler/base/text.h"
#include "tools/base/held_report.h"
#include "tools/base/program.h"

namespace morphbus::tools {
namespace {

/// A line in a loop is come to in every tick, and a log has hours of them.
constexpr size_t kMaxMoments = 1000;

}  // namespace

void BreakTrace::Take(const logger::ComputedStep& step) {
  // A task's end is no instruction, and without a call there is no line.
  if (step.ended != nullptr || step.task.stack.depth == 0) return;
  // The range has its beginning and not its end, so that ranges one behind the other have no moment
  // twice.
  const double seconds = static_cast<double>(step.input.sim_time_us) * 1e-6;
  if (seconds < from_s_ || seconds >= to_s_) return;
  if (program_ != step.program.hash()) {
    program_ = step.program.hash();
    files_ = vm::SourceFiles(step.program);
    line_ = files_.LineOfAll(place_);
  }
  const vm::Frame& frame = step.task.stack.frames[step.task.stack.depth - 1];
  // The first instruction of the line, before which another line's code ends. Jumps into the middle
  // of a line, as by && and ||, are no new arrival at it.
  if (step.program.LineOf(frame.function, frame.pc) != line_) return;
  if (frame.pc > 0 && step.program.LineOf(frame.function, frame.pc - 1) == line_) return;
  // Counted is what is dropped, so that the text can say how much is not shown.
  if (moments_.size() >= kMaxMoments) {
    ++dropped_;
    return;
  }
  const vm::RoleState& role = step.state.role;
  bridge::HeldTask held =
      bridge::ReadTask(step.program, step.kinematics, step.program.role(role.role), step.task);
  // The task has not come to rest here, so it knows only where it waited last.
  held.calls.front().line = line_;
  held.calls.front().locals =
      bridge::ReadLocals(step.program, step.kinematics, frame, frame.pc, step.task.stack.cells);
  const Json task = TasksJson({held}, files_, ConnectorNames(step.kinematics)).front();
  moments_.push_back(
      // The keys are those of docs/cli.md, in its order; `calls` begins with the innermost.
      {{"tick", step.input.tick},
       {"seconds", seconds},
       {"kind", task["kind"]},
       {"routine", task["routine"]},
       {"program", ToString(step.program.source_name())},
       {"calls", task["calls"]},
       {"fields", FieldsJson(bridge::ReadFields(step.program, step.kinematics, role))}});
}

std::string BreaksText(const Json& moments, int64_t dropped) {
  std::string text;
  for (const Json& moment : moments) {
    text += fmt::format("tick {} ({:.2f} s): {} {}\n{}{}", moment["tick"].get<int64_t>(),
                        moment["seconds"].get<double>(), moment["kind"].get<std::string>(),
                        moment["routine"].get<std::string>(), CallsText(moment["calls"]),
                        FieldsText(moment["fields"]));
  }
  if (dropped > 0) text += fmt::format("and {} more\n", Counted(dropped, "time"));
  return text;
}

}  // namespace morphbus::tools
