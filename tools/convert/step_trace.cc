#include "tools/convert/step_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "bridge/module/read_held.h"
#include "tools/base/held_report.h"
#include "tools/base/program.h"
#include "vm/image/disassembler.h"
#include "vm/image/fault_text.h"
#include "vm/image/print_line.h"
#include "vm/image/source_places.h"

namespace morphbus::tools {
namespace {

/// A tick has some thousand instructions at most; an image with a larger budget has more.
constexpr size_t kMaxSteps = 100000;

/// The operands that lie ready for an instruction, in their order; none for one of which neither
/// the table nor what its operand names tells the types.
Json OperandsOf(const logger::ComputedStep& step, const vm::Frame& frame) {
  const vm::FunctionInfo function = step.program.function(frame.function);
  // The verifier has proved that an instruction begins here, that its operand is whole, and that so
  // many values lie on the stack.
  const uint8_t* at = step.program.bytes() + function.code_begin + frame.pc;
  const vm::OpcodeInfo& info = vm::kOpcodes[*at];
  std::vector<vm::ValueType> types;
  for (const vm::Term term : info.pops) {
    // A store takes what fits the variable that it names.
    const vm::ValueType type = term.part() < 0 ? term.type()
                                               : vm::TypeNamedBy(info.operand, term.part(),
                                                                 step.program, function, at + 1);
    if (type == vm::ValueType::kVoid) return Json::array();
    types.push_back(type);
  }
  // The operands are the topmost values of the stack, the first one lowest.
  const vm::Cell* cell = step.task.stack.cells + step.task.stack.top - types.size();
  Json operands = Json::array();
  for (const vm::ValueType type : types) {
    operands.push_back(vm::ValueText(step.program, &step.kinematics, type, *cell++));
  }
  return operands;
}

/// How the run of a task in a tick ended.
std::string EndingText(const logger::ComputedStep& step) {
  // These are all ways in which the interpreter gives a task back.
  switch (step.ended->status) {
    case vm::RunStatus::kFinished:
      return "finished";
    case vm::RunStatus::kWaiting:
      return "waits for " +
             WaitText(WaitJson(step.task.wait, step.task.wake_us,
                               step.task.wait == vm::WaitKind::kMotion
                                   ? ToString(step.kinematics.joint(step.task.wait_joint).name)
                                   : ""));
    case vm::RunStatus::kOutOfBudget:
      return "has used up its share of the tick's budget";
    case vm::RunStatus::kFaulted:
      return std::string("fault: ") + vm::FaultName(step.ended->fault);
  }
  return "";
}

}  // namespace

StepTrace::Moment StepTrace::MomentOf(const logger::ComputedStep& step) {
  Moment now;
  now.depth = step.task.stack.depth;
  // A task that has finished stands nowhere.
  if (now.depth > 0) {
    const vm::Frame& frame = step.task.stack.frames[now.depth - 1];
    now.function = frame.function;
    now.pc = frame.pc;
    now.line = step.program.LineOf(frame.function, frame.pc);
    now.locals = LocalsForPeople(
        bridge::ReadLocals(step.program, step.kinematics, frame, frame.pc, step.task.stack.cells),
        ConnectorNames(step.kinematics));
  }
  now.fields = bridge::ReadFields(step.program, step.kinematics, step.state.role);
  return now;
}

void StepTrace::NoteChanges(const Moment& now) {
  Json& changed = steps_.back()["changed"];
  const auto note = [&changed](const char* kind, const std::vector<bridge::HeldValue>& before,
                               const std::vector<bridge::HeldValue>& after) {
    for (size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
      // Behind its scope a variable has no value any more.
      // Values are compared as texts: what would be printed alike has not changed for the reader.
      if (after[i].value == before[i].value || after[i].value.empty()) continue;
      const std::string& name = after[i].name;
      changed[fmt::format("{} {}", kind, name.empty() ? std::to_string(i) : name)] = after[i].value;
    }
  };
  // The locals of another call are other variables.
  if (now.depth == begun_.depth && now.function == begun_.function) {
    note("local", begun_.locals, now.locals);
  }
  note("field", begun_.fields, now.fields);
}

bool StepTrace::GoesOn(const Moment& now) const {
  // A jump back within the line, as of a loop that is written in one line, begins a step anew.
  return by_ == By::kLine && now.depth == begun_.depth && now.function == begun_.function &&
         now.line == begun_.line && now.pc > last_pc_;
}

void StepTrace::Begin(const logger::ComputedStep& step, Moment now) {
  const vm::Frame& frame = step.task.stack.frames[now.depth - 1];
  const vm::SourcePlace place = vm::SourceFiles(step.program).Of(now.line);
  Json json = {{"task", vm::TaskKindName(step.task.kind)},
               {"depth", now.depth},
               {"function", ToString(step.program.function_name(now.function))},
               {"source", place.file},
               {"line", place.line},
               {"locals", LocalsJson(now.locals)},
               {"changed", Json::object()}};
  // Lines are told by their number, instructions by what they are about to do.
  if (by_ == By::kInstruction) {
    json["pc"] = now.pc;
    json["instruction"] = vm::InstructionText(step.program, now.function, now.pc);
    json["operands"] = OperandsOf(step, frame);
  }
  steps_.push_back(std::move(json));
  last_pc_ = now.pc;
  begun_ = std::move(now);
}

void StepTrace::Take(const logger::ComputedStep& step) {
  // A step of a line goes on for as many instructions as belong to it.
  Moment now = MomentOf(step);
  const bool ended = step.ended != nullptr;
  if (open_ && !ended && GoesOn(now)) {
    last_pc_ = now.pc;
    return;
  }
  // The step before is over.
  if (open_) NoteChanges(now);
  if (open_ && ended) steps_.back()["then"] = EndingText(step);
  // Beyond the limit nothing is open any more, and every further instruction counts as dropped.
  open_ = !ended && steps_.size() < kMaxSteps;
  if (open_) {
    Begin(step, std::move(now));
  } else if (!ended) {
    ++dropped_;
  }
}

std::string StepsText(const Json& steps, int64_t dropped) {
  std::string text;
  bool begins = true;  // A run of a task begins with this step.
  for (const Json& step : steps) {
    if (begins) text += fmt::format("  {}\n", step["task"].get<std::string>());
    begins = step.contains("then");
    // Calls are indented by how deep they are.
    const int indent = 2 + 2 * step["depth"].get<int>();
    std::string line = fmt::format("{:{}}{}:{} {}", "", indent, step["source"].get<std::string>(),
                                   step["line"].get<int>(), step["function"].get<std::string>());
    // What it works with: the operands of an instruction, the variables of a line.
    const auto list = [](const Json& values) {
      std::string joined;
      for (const Json& value : values) {
        joined += (joined.empty() ? "" : ", ") + value.get<std::string>();
      }
      return joined;
    };
    if (step.contains("instruction")) {
      line += fmt::format("  {:04x}  {}", step["pc"].get<int>(),
                          step["instruction"].get<std::string>());
      if (!step["operands"].empty()) line += "  of " + list(step["operands"]);
    } else if (!step["locals"].empty()) {
      line += "  " + LocalsText(step["locals"]);
    }
    text += line + "\n";
    // What it has changed, and how the task's run ended if it ended with it.
    for (const auto& [name, value] : step["changed"].items()) {
      text += fmt::format("{:{}}{} = {}\n", "", indent + 4, name, value.get<std::string>());
    }
    if (begins) text += fmt::format("    {}\n", step["then"].get<std::string>());
  }
  if (dropped > 0) text += fmt::format("  and {} more\n", Counted(dropped, "instruction"));
  return text;
}

}  // namespace morphbus::tools
