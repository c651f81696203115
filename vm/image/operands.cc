#include "vm/image/operands.h"

#include "vm/image/program.h"

namespace morphbus::vm {

namespace {

/// The type of the part of a module that a keyword names; kVoid if it names no part.
ValueType TypeOfPart(KeywordKind kind) {
  // States and sensors are no values: they are operands of the instructions that read them.
  switch (kind) {
    case KeywordKind::kLink:
      return ValueType::kLink;
    case KeywordKind::kJoint:
      return ValueType::kJoint;
    case KeywordKind::kConnector:
      return ValueType::kConnector;
    default:
      return ValueType::kVoid;
  }
}

}  // namespace

ValueType TypeNamedBy(OperandPart part, const VerifiedProgram& program,
                      const FunctionInfo& function, const uint8_t* at) {
  // Slots belong to the role in which the function stands, all other numbers to the program.
  const auto number = static_cast<int>(NumberIn(part, at));
  switch (part) {
    case OperandPart::kConstant:
    case OperandPart::kIntConstant:
    case OperandPart::kText:
      return program.constant_type(number);
    case OperandPart::kLocal:
    case OperandPart::kIntLocal:
    case OperandPart::kStoredLocal:
      return function.local_types[number];
    case OperandPart::kField:
      return program.role(function.role).fields.type(number);
    case OperandPart::kLocalArray:
      return function.local_types[number & 255];
    case OperandPart::kFieldArray:
      return program.role(function.role).fields.type(number & 255);
    case OperandPart::kSharedField:
      // The role stands before it.
      return program.role(at[-1]).fields.type(number);
    // A label's function says whether it names a joint or a link.
    case OperandPart::kLabel:
      return program.function(program.role(function.role).labels[number]).return_type;
    case OperandPart::kPartKeyword:
      // Its kind alone says what the keyword is to the program.
      return TypeOfPart(program.keyword(number).kind);
    default:
      return ValueType::kVoid;
  }
}

ValueType TypeNamedBy(OperandKind kind, int i, const VerifiedProgram& program,
                      const FunctionInfo& function, const uint8_t* at) {
  const OperandInfo& info = InfoOf(kind);
  // Parts have no fixed place in the operand, but follow each other by their sizes.
  for (int before = 0; before < i; ++before) at += BytesOf(info.parts[before]);
  return TypeNamedBy(info.parts[i], program, function, at);
}

}  // namespace morphbus::vm
