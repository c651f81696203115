// Sensors: by name, or any of their kind by where it looks.

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/checker.h"

namespace morphbus::dynarole {

namespace {

/// What an instruction reads.
vm::SensorKind KindOf(vm::Opcode opcode) {
  if (opcode == vm::Opcode::kDistance) return vm::SensorKind::kDistance;
  return opcode == vm::Opcode::kContact ? vm::SensorKind::kContact : vm::SensorKind::kTilt;
}

}  // namespace

// What a sensor is asked must be what it measures in some module type.
Type Checker::InferSensor(Expr* member, Expr* call, int keyword) {
  const keywords::Keyword& entry = keywords_.all()[keyword];
  std::string usages;
  const Builtin* form = nullptr;
  for (size_t kind = 0; kind < SensorBuiltins().size(); ++kind) {
    const Builtin& builtin = SensorBuiltins()[kind];
    if ((entry.measures >> kind & 1) == 0) continue;
    usages += (usages.empty() ? "self." : " or self.") + entry.spelling + "." + builtin.name + "()";
    if (member->name == builtin.name) form = &builtin;
  }
  if (form == nullptr || call == nullptr || call->operands.size() != 1) {
    return Wrong(member->name_span,
                 "sensor " + entry.spelling + " is not read by '" + member->name + "'",
                 "write " + usages);
  }
  if (UseKeyword(member, keyword) == Type::kError) return Type::kError;
  // The keyword is the instruction's operand; nothing of what stands before the dot is pushed.
  call->meaning = Meaning::kBuiltin;
  call->opcode = form->opcode;
  call->index = member->index;
  member->operands[0]->meaning = Meaning::kNone;
  Uses(form->opcode, member->name_span, member->name);
  return TypePushedBy(form->opcode);
}

Type Checker::UseSensorKind(Expr* expr, const source::Span& span) {
  const vm::Text kind = vm::kSensorKindNames[static_cast<int>(KindOf(expr->opcode))];
  const int keyword =
      keywords_.Find(vm::KeywordKind::kSensorKind, std::string(kind.data, kind.size));
  if (keyword < 0) {
    static constexpr const char* kWords[] = {"distance", "contact", "tilt"};
    const std::string word = kWords[static_cast<int>(KindOf(expr->opcode))];
    return Wrong(span, "no module type that was given has a " + word + " sensor",
                 keywords_.empty() ? "no module types were given"
                                   : "declare one in M3L: sensor NAME: type=" + word + ", ...");
  }
  // UseKeyword makes the expression mean the part; here it is an operand of the call.
  const Meaning meaning = expr->meaning;
  const Type used = UseKeyword(expr, keyword);
  expr->meaning = meaning;
  return used == Type::kError ? Type::kError : TypePushedBy(expr->opcode);
}

}  // namespace morphbus::dynarole
