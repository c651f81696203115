#include "vm/disassembler.h"

#include <fmt/format.h>

#include <map>
#include <memory>

#include "vm/image.h"
#include "vm/opcodes.h"
#include "vm/verifier.h"

namespace morphbus::vm {

namespace {

using image::ReadU16;
using image::ReadU32;
using image::Section;
using image::SectionOf;

std::string Str(Text text) { return std::string(text.data, text.size); }

const char* TypeName(ValueType type) {
  constexpr const char* kNames[] = {"void",      "bool",   "int",   "float", "direction",
                                    "axis",      "role",   "joint", "link",  "modules",
                                    "connector", "joints", "links"};
  return kNames[static_cast<int>(type)];
}

const char* DirectionName(uint32_t bits) {
  constexpr const char* kNames[] = {"$ANY", "$NORTH", "$SOUTH", "$EAST", "$WEST", "$UP", "$DOWN"};
  return bits < 7 ? kNames[bits] : "?";
}

const char* AxisName(uint32_t bits) {
  constexpr const char* kNames[] = {"$ANY", "$NORTH_SOUTH", "$UP_DOWN", "$EAST_WEST"};
  return bits < 4 ? kNames[bits] : "?";
}

const char* KindName(KeywordKind kind) {
  constexpr const char* kNames[] = {"link", "joint", "connector", "state"};
  return kNames[static_cast<int>(kind)];
}

const char* EventName(Event event) {
  constexpr const char* kNames[] = {"on_connect", "on_disconnect", "on_stall", "on_timer"};
  return kNames[static_cast<int>(event)];
}

class Printer {
 public:
  explicit Printer(const VerifiedProgram& program) : program_(program) {}

  std::string Print() {
    PrintHeader();
    for (int i = 0; i < program_.num_roles(); ++i) PrintRole(i);
    for (int i = 0; i < program_.num_functions(); ++i) PrintFunction(i);
    return out_;
  }

 private:
  std::string ValueText(ValueType type, Cell cell) const {
    switch (type) {
      case ValueType::kBool:
        return cell.AsBool() ? "true" : "false";
      case ValueType::kFloat:
        return fmt::format("{:.9g}", static_cast<double>(cell.AsFloat()));
      case ValueType::kDirection:
        return DirectionName(cell.bits);
      case ValueType::kAxis:
        return AxisName(cell.bits);
      case ValueType::kRole:
        return "$" + Str(program_.role(cell.AsInt()).name);
      default:
        return std::to_string(cell.AsInt());
    }
  }

  void PrintHeader() {
    out_ += fmt::format("; {}, {} bytes, hash {:016x}\n", Str(program_.source_name()).c_str(),
                        program_.size(), program_.hash());
    out_ += fmt::format("; budget {}, settle ticks {}\n", program_.instruction_budget(),
                        program_.settle_ticks());
    for (int i = 0; i < program_.num_keywords(); ++i) {
      const KeywordInfo& keyword = program_.keyword(i);
      out_ += fmt::format("keyword {} {} ", i, KindName(keyword.kind)) + Str(keyword.name) + "\n";
    }
    const image::SectionRange constants = SectionOf(program_.bytes(), Section::kConstants);
    for (uint32_t i = 0; i < constants.count; ++i) {
      const ValueType type = ConstantType(i);
      out_ += fmt::format("constant {} {} ", i, TypeName(type)) +
              ValueText(type, program_.constant(static_cast<int>(i))) + "\n";
    }
  }

  [[nodiscard]] ValueType ConstantType(uint32_t i) const {
    const image::SectionRange constants = SectionOf(program_.bytes(), Section::kConstants);
    return static_cast<ValueType>(program_.bytes()[constants.begin + i * image::kConstantBytes]);
  }

  [[nodiscard]] std::string FunctionName(int function) const {
    return Str(program_.function(function).name);
  }

  void PrintRole(int index) {
    const RoleInfo& role = program_.role(index);
    out_ +=
        fmt::format("\n{}role {} ", role.abstract_role ? "abstract " : "", index) + Str(role.name);
    if (role.parent >= 0) out_ += " extends " + Str(program_.role(role.parent).name);
    out_ += "\n";
    for (int i = 0; i < role.num_fields; ++i) {
      out_ += fmt::format("  field {} {} ", i, TypeName(role.field_types[i])) +
              FieldName(index, i) + " = " + ValueText(role.field_types[i], role.fields[i]) + "\n";
    }
    for (int i = 0; i < role.num_labels; ++i) {
      out_ += fmt::format("  label {} {} ", i, TypeName(role.labels[i].type)) +
              Str(role.labels[i].name) + ": " + FunctionName(role.labels[i].function) + "\n";
    }
    for (int i = 0; i < role.num_requirements; ++i) {
      out_ += "  require " + FunctionName(role.requirements[i]) + "\n";
    }
    PrintRoutines("startup", role.startups, role.num_startups);
    PrintRoutines("behavior", role.behaviors, role.num_behaviors);
    PrintRoutines("command", role.commands, role.num_commands);
    for (int i = 0; i < role.num_handlers; ++i) {
      out_ += fmt::format("  handler {}: ", EventName(role.handlers[i].event)) +
              FunctionName(role.handlers[i].function) + "\n";
    }
    for (int i = 0; i < role.num_methods; ++i) {
      out_ += fmt::format("  function {}: ", i) + FunctionName(role.methods[i]) + "\n";
    }
    for (int i = 0; i < role.num_keywords; ++i) {
      out_ += "  needs " + Str(program_.keyword(role.keywords[i]).name) + "\n";
    }
  }

  void PrintRoutines(const char* kind, const RoutineInfo* routines, int count) {
    for (int i = 0; i < count; ++i) {
      out_ += fmt::format("  {} {} ", kind, i) + Str(routines[i].name) + ": " +
              FunctionName(routines[i].function) + "\n";
    }
  }

  // Names of fields stand only in the bytes; the running VM has no use for them.
  [[nodiscard]] std::string FieldName(int role, int field) const {
    constexpr uint32_t kBytes[image::kRoleCounts] = {9, 7, 2, 6, 6, 6, 3, 2};
    const uint8_t* bytes = program_.bytes();
    uint32_t at = SectionOf(bytes, Section::kRoles).begin;
    for (int i = 0; i < role; ++i) {
      const uint8_t* counts = bytes + at + 8;
      at += image::kRoleHeadBytes;
      for (int k = 0; k < image::kRoleCounts; ++k) at += counts[k] * kBytes[k];
    }
    at += image::kRoleHeadBytes + static_cast<uint32_t>(field) * 9;
    return std::string(reinterpret_cast<const char*>(bytes) +
                           SectionOf(bytes, Section::kStrings).begin + ReadU16(bytes + at),
                       ReadU16(bytes + at + 2));
  }

  [[nodiscard]] int OwnerOf(int function) const {
    return program_
        .bytes()[SectionOf(program_.bytes(), Section::kFunctions).begin +
                 static_cast<uint32_t>(function) * image::kFunctionBytes + image::kFunctionRoleAt];
  }

  void PrintFunction(int index) {
    const FunctionInfo& function = program_.function(index);
    out_ += fmt::format("\nfunction {} ", index) + Str(function.name) + "(";
    for (int i = 0; i < function.num_arguments; ++i) {
      out_ += fmt::format("{}{}", i > 0 ? ", " : "", TypeName(function.local_types[i]));
    }
    out_ += fmt::format(") -> {}  ; locals {}, stack {}, calls {} deep, {} cells\n",
                        TypeName(function.return_type), function.num_locals, function.max_stack,
                        function.call_depth, function.total_cells);
    const uint8_t* code = program_.bytes() + function.code_begin;
    const std::map<uint32_t, int> targets = TargetsOf(index);
    int last_line = 0;
    for (uint32_t pc = 0; pc < function.code_size;) {
      const auto target = targets.find(pc);
      if (target != targets.end()) out_ += fmt::format("L{}:\n", target->second);
      const OpcodeInfo& info = kOpcodes[code[pc]];
      std::string line = fmt::format("  {:04x}  {}", pc, info.mnemonic);
      const std::string operand = OperandText(index, info.operand, code + pc + 1, targets);
      if (!operand.empty()) {
        line.resize(std::max<size_t>(line.size() + 1, 24), ' ');
        line += operand;
      }
      const int source_line = program_.LineOf(index, pc);
      if (source_line != last_line) {
        line.resize(std::max<size_t>(line.size() + 1, 56), ' ');
        line += fmt::format("; line {}", source_line);
        last_line = source_line;
      }
      out_ += line + "\n";
      pc += 1 + OperandBytes(info.operand);
    }
  }

  // Numbers the joins of a function in order.
  [[nodiscard]] std::map<uint32_t, int> TargetsOf(int index) const {
    const uint8_t* bytes = program_.bytes();
    const uint8_t* record = bytes + SectionOf(bytes, Section::kFunctions).begin +
                            static_cast<uint32_t>(index) * image::kFunctionBytes;
    const uint32_t first = ReadU16(record + image::kFunctionFirstJoinAt);
    const uint32_t count = ReadU16(record + image::kFunctionJoinsAt);
    std::map<uint32_t, int> targets;
    for (uint32_t i = 0; i < count; ++i) {
      const uint8_t* join =
          bytes + SectionOf(bytes, Section::kJoins).begin + (first + i) * image::kJoinBytes;
      targets.emplace(ReadU16(join), static_cast<int>(i));
    }
    return targets;
  }

  [[nodiscard]] std::string OperandText(int function, OperandKind kind, const uint8_t* operand,
                                        const std::map<uint32_t, int>& targets) const {
    const RoleInfo& owner = program_.role(OwnerOf(function));
    switch (kind) {
      case OperandKind::kNone:
        return "";
      case OperandKind::kInt8:
        return std::to_string(static_cast<int8_t>(operand[0]));
      case OperandKind::kConstant: {
        const uint32_t i = ReadU16(operand);
        return ValueText(ConstantType(i), program_.constant(static_cast<int>(i)));
      }
      case OperandKind::kLocal:
        return fmt::format("local {}", operand[0]);
      case OperandKind::kField:
        return FieldName(OwnerOf(function), operand[0]);
      case OperandKind::kLabel:
        return Str(owner.labels[operand[0]].name);
      case OperandKind::kKeyword:
        return Str(program_.keyword(operand[0]).name);
      case OperandKind::kMethod:
        return FunctionName(owner.methods[operand[0]]);
      case OperandKind::kTarget:
        return fmt::format("L{}", targets.at(ReadU16(operand)));
      case OperandKind::kRoleCommand: {
        const RoleInfo& role = program_.role(operand[0]);
        return Str(role.name) + "." + Str(role.commands[operand[1]].name);
      }
    }
    return "";
  }

  const VerifiedProgram& program_;
  std::string out_;
};

// "ii" becomes "int int".
std::string SignatureText(const char* letters) {
  std::string text;
  for (; *letters != '\0'; ++letters) {
    if (!text.empty()) text += " ";
    text += *letters == '*' ? "any" : TypeName(TypeOfLetter(*letters));
  }
  return text.empty() ? "–" : text;
}

}  // namespace

std::string Disassemble(const VerifiedProgram& program) { return Printer(program).Print(); }

std::string DisassembleImage(const uint8_t* bytes, uint32_t size, bool* ok) {
  const auto program = std::make_unique<VerifiedProgram>();
  const VerifyError error = Verifier::Verify(bytes, size, program.get());
  if (ok != nullptr) *ok = error.message == nullptr;
  if (error.message != nullptr) {
    return fmt::format("refused at byte {}: {}\n", error.offset, error.message);
  }
  return Disassemble(*program);
}

std::string InstructionTable() {
  constexpr const char* kOperands[] = {"–",     "byte",    "constant", "local",  "field",
                                       "label", "keyword", "function", "target", "role, command"};
  constexpr const char* kEffects[] = {"pure", "task", "wait"};
  std::string out =
      "| code | instruction | operand | pops | pushes | cost | effect | meaning |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (int i = 0; i < kNumOpcodes; ++i) {
    const OpcodeInfo& info = kOpcodes[i];
    out += fmt::format("| {:02x} | `{}` | {} | ", i, info.mnemonic,
                       kOperands[static_cast<int>(info.operand)]) +
           SignatureText(info.pops) + " | " + SignatureText(info.pushes) +
           fmt::format(" | {} | {} | {} |\n", info.cost, kEffects[static_cast<int>(info.effect)],
                       info.meaning);
  }
  return out;
}

}  // namespace morphbus::vm
