#include "bridge/description/program_words.h"

#include "compiler/dynarole/parameters.h"
#include "vm/image/print_line.h"

namespace morphbus::bridge {
namespace {

/// Where a line of the program stands whose own file is `file`; of one that is not known both stay
/// as they are.
vm::SourcePlace PlaceOf(const vm::VerifiedProgram* program, const std::string& file, int line) {
  if (program == nullptr) return {file, line};
  return vm::SourceFiles(*program).Of(line, file);
}

}  // namespace

bool IsOwnProgram(const RunModel& run, const vm::VerifiedProgram& program) {
  return run.has_program && run.images.program().SameButForParameters(program);
}

const vm::VerifiedProgram* ProgramWords::Find(uint64_t hash, std::string* file) {
  // The run's own program is the one of nearly all reports; its file is called as it was given.
  if (run_ != nullptr && hash == run_->program_hash) *file = run_->program_file;
  if (run_ != nullptr && run_->has_program && run_->images.program().hash() == hash) {
    return &run_->images.program();
  }
  // Any other program was deployed during the run. Its image is verified once, also if it is bad.
  const auto image = deployed_.find(hash);
  if (image == deployed_.end()) return nullptr;
  auto known = verified_.find(hash);
  if (known == verified_.end()) {
    auto images = std::make_shared<ModuleImages>();
    const std::string& bytes = image->second;
    if (!images->AddProgram("program", {bytes.begin(), bytes.end()})) images = nullptr;
    known = verified_.emplace(hash, std::move(images)).first;
  }
  if (known->second == nullptr) return nullptr;
  // Where an image of a deployment came from only the image itself says, unless it is the run's own
  // with other values.
  const vm::VerifiedProgram& program = known->second->program();
  if (run_ != nullptr && IsOwnProgram(*run_, program)) {
    *file = run_->program_file;
    return &program;
  }
  const vm::Text source = program.source_name();
  file->assign(source.data, source.size);
  return &program;
}

uint64_t ProgramWords::SourceHash(uint64_t program_hash) {
  std::string file;
  const vm::VerifiedProgram* program = Find(program_hash, &file);
  return program == nullptr ? program_hash : dynarole::HashOfSource(*program);
}

ReportWords ProgramWords::Fault(uint64_t program_hash, const std::string& type,
                                const vm::Fault& fault) {
  ReportWords words;
  // A fault has a sentence also where the program is unknown: names are then numbers.
  const vm::FaultContext context{Find(program_hash, &words.program), FindKinematics(type)};
  words.place = PlaceOf(context.program, words.program, fault.line);
  words.text = vm::FaultSentence(fault, context);
  words.function = vm::FaultFunction(fault, context.program);
  words.task = vm::FaultTask(fault, context.program);
  return words;
}

ReportWords ProgramWords::Print(uint64_t program_hash, const std::string& type,
                                const vm::PrintReport& print) {
  ReportWords words;
  const vm::VerifiedProgram* program = Find(program_hash, &words.program);
  words.place = PlaceOf(program, words.program, print.line);
  // The text that a program prints stands in its image, and in no message.
  if (program == nullptr) {
    words.text = "text " + std::to_string(print.text) + " of a program that is not known here";
    return words;
  }
  words.text =
      vm::PrintText(*program, FindKinematics(type), print.text, print.values, print.num_values);
  return words;
}

vm::SourcePlace ProgramWords::Place(uint64_t program_hash, int line) {
  std::string file;
  const vm::VerifiedProgram* program = Find(program_hash, &file);
  return PlaceOf(program, file, line);
}

TracedValue ProgramWords::Trace(uint64_t program_hash, int role, const vm::TraceReport& trace) {
  std::string file;
  const vm::VerifiedProgram* program = Find(program_hash, &file);
  // Only the program knows the field's type.
  if (program == nullptr || role < 0 || role >= program->num_roles()) return {};
  const vm::RoleInfo info = program->role(role);
  if (trace.field >= info.num_fields) return {};
  const vm::Text name = program->field_name(role, trace.field);
  const bool is_float = info.fields.type(trace.field) == vm::ValueType::kFloat;
  return {{name.data, name.size},
          is_float ? static_cast<double>(trace.value.AsFloat())
                   : static_cast<double>(trace.value.AsInt())};
}

}  // namespace morphbus::bridge
