#include "vm/image/disassembler.h"

#include <fmt/format.h>

#include <map>
#include <memory>

#include "vm/image/image.h"
#include "vm/image/image_texts.h"
#include "vm/image/join_table.h"
#include "vm/image/opcodes.h"
#include "vm/image/print_line.h"
#include "vm/image/source_places.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

namespace {

using image::Section;
using image::SectionOf;

// Words for what the image holds as numbers.
const char* TypeName(ValueType type) { return InfoOf(type).word; }

/// What a keyword names, in the order of KeywordKind.
const char* KindName(KeywordKind kind) {
  constexpr const char* kNames[] = {"link", "joint", "connector", "state", "sensor", "any"};
  return kNames[static_cast<int>(kind)];
}

/// As handlers are declared in a program.
const char* EventName(Event event) {
  constexpr const char* kNames[] = {"on_connect", "on_disconnect", "on_stall", "on_timer"};
  return kNames[static_cast<int>(event)];
}

/// A constant, a field's first value or an operand as it would stand in a program.
std::string ValueText(const VerifiedProgram& program, ValueType type, Cell cell) {
  switch (type) {
    case ValueType::kFloat:
      return fmt::format("{:.9g}", static_cast<double>(cell.AsFloat()));
    case ValueType::kRole:
      return "$" + ToString(program.role(cell.AsInt()).name);
    case ValueType::kText: {
      const image::SectionRange strings = SectionOf(program.bytes(), Section::kStrings);
      const char* begin = reinterpret_cast<const char*>(program.bytes() + strings.begin);
      return '"' + std::string(begin + (cell.bits & 0xffff), cell.bits >> 16) + '"';
    }
    // All else as it is printed; what an image holds has no value that names a part of a module.
    default:
      return vm::ValueText(program, nullptr, type, cell);
  }
}

/// Writes the text of one program from top to bottom.
class Printer {
 public:
  explicit Printer(const VerifiedProgram& program) : program_(program), files_(program) {}

  std::string Print() {
    PrintHeader();
    for (int i = 0; i < program_.num_roles(); ++i) PrintRole(i);
    for (int i = 0; i < program_.num_functions(); ++i) PrintFunction(i);
    return out_;
  }

  /// One instruction of a function, with its operand.
  [[nodiscard]] std::string Instruction(int function, uint32_t pc) const {
    // One instruction alone needs the labels of its function, too, as it may jump.
    const uint8_t* at = program_.bytes() + program_.function(function).code_begin + pc;
    const std::string operand =
        OperandText(function, kOpcodes[*at].operand, at + 1, TargetsOf(function));
    return kOpcodeTexts[*at].mnemonic + (operand.empty() ? "" : " " + operand);
  }

 private:
  template <class... Arguments>
  void Add(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    out_ += fmt::format(format, std::forward<Arguments>(arguments)...);
  }

  /// Comments for people, then keywords and constants, which code refers to by number.
  void PrintHeader() {
    // What the header holds, and what stands behind the part that runs.
    Add("; {}, {} bytes and {} of notes, hash {:016x}\n", ToString(program_.source_name()),
        program_.run_size(), program_.size() - program_.run_size(), program_.hash());
    Add("; budget {}, settle ticks {}\n", program_.instruction_budget(), program_.settle_ticks());
    for (int i = 0; i < program_.num_keywords(); ++i) {
      const KeywordInfo keyword = program_.keyword(i);
      Add("keyword {} {} {}\n", i, KindName(keyword.kind), ToString(keyword.name));
    }
    // Constants are shared by all functions.
    for (int i = 0; i < program_.num_constants(); ++i) {
      const ValueType type = program_.constant_type(i);
      Add("constant {} {} {}{}\n", i, TypeName(type),
          ValueText(program_, type, program_.constant(i)), ParameterText(i));
    }
  }

  /// What makes a constant a parameter; empty for any other one.
  [[nodiscard]] std::string ParameterText(int constant) const {
    if (!program_.is_parameter(constant)) return "";
    int number = 0;
    for (int i = 0; i < constant; ++i) number += program_.is_parameter(i) ? 1 : 0;
    if (!program_.has_notes()) return fmt::format(" parameter {}", number);
    const ParameterInfo parameter = program_.parameter(number);
    return fmt::format(" parameter {} in [{}, {}]", ToString(parameter.name),
                       ValueText(program_, parameter.type, parameter.least),
                       ValueText(program_, parameter.type, parameter.most));
  }

  // An image without notes has no names but those of roles and keywords; numbers stand for them.
  [[nodiscard]] std::string FunctionName(int function) const {
    return program_.has_notes() ? ToString(program_.function_name(function))
                                : fmt::format("function {}", function);
  }
  [[nodiscard]] std::string MemberName(int function) const {
    return program_.has_notes() ? ToString(program_.member_name(function))
                                : fmt::format("function {}", function);
  }
  [[nodiscard]] std::string FieldName(int role, int field) const {
    return program_.has_notes() ? ToString(program_.field_name(role, field))
                                : fmt::format("field {}", field);
  }

  /// A role with all members, inherited ones too, each with its slot.
  void PrintRole(int index) {
    // The slots are those by which code refers to fields, labels, commands and functions.
    const RoleInfo role = program_.role(index);
    Add("\n{}role {} {}{}\n", role.abstract_role ? "abstract " : "", index, ToString(role.name),
        role.parent >= 0 ? " extends " + ToString(program_.role(role.parent).name) : "");
    // Fields have values, labels and all else functions.
    for (int i = 0; i < role.num_fields; ++i) {
      Add("  {}field {} {} {} = {}\n", role.fields.shared(i) ? "shared " : "", i,
          TypeName(role.fields.type(i)), FieldName(index, i),
          ValueText(program_, role.fields.type(i), role.fields[i]));
    }
    for (int i = 0; i < role.num_labels; ++i) {
      const int function = role.labels[i];
      Add("  label {} {} {}: {}\n", i, TypeName(program_.function(function).return_type),
          MemberName(function), FunctionName(function));
    }
    // Nothing refers to a requirement, which so has no slot.
    for (int i = 0; i < role.num_requirements; ++i) {
      Add("  require {}\n", FunctionName(role.requirements[i]));
    }
    PrintRoutines("startup", role.startups, role.num_startups);
    PrintRoutines("behavior", role.behaviors, role.num_behaviors);
    PrintRoutines("command", role.commands, role.num_commands);
    for (int i = 0; i < role.num_handlers; ++i) {
      const HandlerInfo handler = role.handlers[i];
      // Only a timer runs by itself.
      const std::string period =
          handler.event == Event::kTimer
              ? fmt::format(" every {:.9g}", static_cast<double>(handler.period_us) * 1e-6)
              : "";
      Add("  handler {}{}{}: {}\n", EventName(handler.event), period, handler.early ? " early" : "",
          FunctionName(handler.function));
    }
    for (int i = 0; i < role.num_methods; ++i) {
      Add("  function {}: {}\n", i, FunctionName(role.methods[i]));
    }
    // Last, what a module type must have for the role.
    for (int i = 0; i < program_.num_keywords(); ++i) {
      if ((program_.keywords_of_role(index) >> i & 1) == 0) continue;
      Add("  needs {}\n", ToString(program_.keyword(i).name));
    }
  }

  /// Members of one kind, each with its slot and its function.
  void PrintRoutines(const char* kind, const ReferenceTable& routines, int count) {
    for (int i = 0; i < count; ++i) {
      Add("  {} {} {}: {}\n", kind, i, MemberName(routines[i]), FunctionName(routines[i]));
    }
  }

  /// The role whose slots a function's code refers to.
  [[nodiscard]] int OwnerOf(int function) const { return program_.function(function).role; }

  /// The signature, then an instruction a line.
  void PrintFunction(int index) {
    const FunctionInfo function = program_.function(index);
    Add("\nfunction {} {}(", index, FunctionName(index));
    for (int i = 0; i < function.num_arguments; ++i) {
      Add("{}{}", i > 0 ? ", " : "", TypeName(function.local_types[i]));
    }
    Add(") -> {}  ; locals {}\n", TypeName(function.return_type), function.num_locals);
    // Jump targets get labels; a source line is printed where it changes.
    const uint8_t* code = program_.bytes() + function.code_begin;
    const std::map<uint32_t, int> targets = TargetsOf(index);
    int last_line = 0;
    for (uint32_t pc = 0; pc < function.code_size;) {
      // A join gets its label before the instruction.
      const auto target = targets.find(pc);
      if (target != targets.end()) Add("L{}:\n", target->second);
      const OpcodeInfo& info = kOpcodes[code[pc]];
      // Three columns: offset and instruction, operand, source line.
      std::string line = fmt::format("  {:04x}  {}", pc, kOpcodeTexts[code[pc]].mnemonic);
      const std::string operand = OperandText(index, info.operand, code + pc + 1, targets);
      if (!operand.empty()) {
        line.resize(std::max<size_t>(line.size() + 1, 24), ' ');
        line += operand;
      }
      // Instructions of one line stand together, so that the line is named once.
      const int source_line = program_.LineOf(index, pc);
      if (source_line != last_line) {
        line.resize(std::max<size_t>(line.size() + 1, 56), ' ');
        const SourcePlace place = files_.Of(source_line);
        line += place.line == source_line ? fmt::format("; line {}", source_line)
                                          : fmt::format("; {}:{}", place.file, place.line);
        last_line = source_line;
      }
      out_ += line + "\n";
      pc += 1 + OperandBytes(info.operand);
    }
  }

  // Numbers the joins of a function in order.
  [[nodiscard]] std::map<uint32_t, int> TargetsOf(int index) const {
    const FunctionInfo function = program_.function(index);
    const uint32_t end = function.code_begin + function.code_size;
    const JoinTable joins(program_.bytes());
    // A jump can only go to a join, so that the joins are all the labels there are.
    std::map<uint32_t, int> targets;
    for (uint32_t i = joins.FirstFrom(function.code_begin);
         i < joins.count() && joins.target(i) < end; ++i) {
      targets.emplace(joins.target(i) - function.code_begin, static_cast<int>(targets.size()));
    }
    return targets;
  }

  /// The operand, part by part.
  [[nodiscard]] std::string OperandText(int function, OperandKind kind, const uint8_t* operand,
                                        const std::map<uint32_t, int>& targets) const {
    std::string text;
    const OperandPart* parts = InfoOf(kind).parts;
    for (int i = 0; i < kMostParts && parts[i] != OperandPart::kNone; ++i) {
      const PartWords& words = kPartWords[static_cast<int>(parts[i])];
      if (i > 0) text += words.before;
      // Two of a kind share their noun.
      const bool second_of_two = i > 0 && parts[i - 1] == parts[i];
      const bool first_of_two = i + 1 < kMostParts && parts[i + 1] == parts[i];
      if (*words.noun != '\0' && !second_of_two) {
        text += std::string(words.noun) + (first_of_two ? "s " : " ");
      }
      text += NameOf(function, parts[i], operand, targets);
      operand += BytesOf(parts[i]);
    }
    return text;
  }

  /// What a part of an operand names; the function's owner says what slots mean.
  [[nodiscard]] std::string NameOf(int function, OperandPart part, const uint8_t* at,
                                   const std::map<uint32_t, int>& targets) const {
    // Slots are looked up in the owner or in the role that stands before them; numbers of the whole
    // program in its tables.
    const RoleInfo owner = program_.role(OwnerOf(function));
    const auto number = static_cast<int>(NumberIn(part, at));
    switch (part) {
      case OperandPart::kNone:
        return "";
      case OperandPart::kSignedByte:
        return std::to_string(static_cast<int8_t>(number));
      case OperandPart::kConstant:
      case OperandPart::kIntConstant:
      case OperandPart::kText:
        return ValueText(program_, program_.constant_type(number), program_.constant(number));
      case OperandPart::kLocal:
      case OperandPart::kIntLocal:
      case OperandPart::kStoredLocal:
        return std::to_string(number);
      case OperandPart::kField:
        return FieldName(OwnerOf(function), number);
      case OperandPart::kLabel:
        return MemberName(owner.labels[number]);
      case OperandPart::kMethod:
        return FunctionName(owner.methods[number]);
      case OperandPart::kPartKeyword:
      case OperandPart::kStateKeyword:
      case OperandPart::kSensorKeyword:
      case OperandPart::kSensorKindKeyword:
        return ToString(program_.keyword(number).name);
      case OperandPart::kRole:
        return ToString(program_.role(number).name);
      case OperandPart::kCommand:
        return MemberName(program_.role(at[-1]).commands[number]);
      case OperandPart::kLocalArray:
        return ToString(program_.local_name(function, number & 255)) +
               fmt::format("..{}", (number >> 8) - 1);
      case OperandPart::kFieldArray:
        return FieldName(OwnerOf(function), number & 255) + fmt::format("..{}", (number >> 8) - 1);
      case OperandPart::kSharedField:
        return FieldName(at[-1], number);
      case OperandPart::kSuperFunction:
        return FunctionName(number);
      case OperandPart::kTarget:
        return fmt::format("L{}", targets.at(static_cast<uint32_t>(number)));
    }
    return "";
  }

  const VerifiedProgram& program_;
  const SourceFiles files_;
  std::string out_;
};

}  // namespace

std::string Disassemble(const VerifiedProgram& program) { return Printer(program).Print(); }

std::string DisassembleImage(const uint8_t* bytes, uint32_t size, bool* ok) {
  // Only what the verifier accepts can be printed without a look at every bound.
  const auto program = std::make_unique<VerifiedProgram>();
  const VerifyError error = Verifier::Verify(bytes, size, program.get());
  if (ok != nullptr) *ok = error.message == nullptr;
  if (error.message != nullptr) {
    return fmt::format("refused at byte {}: {}\n", error.offset, error.message);
  }
  return Disassemble(*program);
}

std::string InstructionText(const VerifiedProgram& program, int function, uint32_t pc) {
  return Printer(program).Instruction(function, pc);
}

std::string ComparisonText(const Comparison& comparison, const VerifiedProgram& program) {
  return ValueText(program, comparison.type, comparison.left) + " against " +
         ValueText(program, comparison.type, comparison.right);
}

}  // namespace morphbus::vm
