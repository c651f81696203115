#include "compiler/dynarole/array_checker.h"

#include "compiler/base/text.h"
#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

using source::Span;

namespace {

/// Where the element lies that an expression names or an assignment sets; `number`: -1 if it is not
/// known before the program runs.
template <class Node>
void SetPlace(const Array& array, int number, Node* node) {
  // An element whose number is known is a variable or field like others.
  const bool local = array.meaning == Meaning::kLocal;
  node->meaning = number >= 0 ? array.meaning
                  : local     ? Meaning::kLocalElement
                              : Meaning::kFieldElement;
  node->index = array.first + (number >= 0 ? number : 0);
  node->length = array.length;
}

}  // namespace

std::optional<Array> ArrayChecker::Find(const std::string& name) {
  // Variables hide fields, as everywhere.
  if (Local* local = scope_.routine() != nullptr ? scope_.FindLocal(name) : nullptr) {
    if (local->length == 0) return std::nullopt;
    local->used = true;
    return Array{Meaning::kLocal, local->slot, local->length, scope_.routine()->locals[local->slot],
                 local->span};
  }
  const RoleModel& owner = scope_.role();
  const int slot = model_.FindArray(owner, name);
  if (slot < 0) return std::nullopt;
  // All its elements count as read, since one whose number is not known may be any of them.
  const FieldDecl& first = model_.fields[owner.fields[slot].decl];
  for (int i = 0; i < first.length && scope_.routine() != nullptr; ++i) {
    model_.fields[owner.fields[slot + i].decl].read = true;
  }
  return Array{Meaning::kField, slot, first.length, first.type, first.span};
}

Type ArrayChecker::AsValue(const Span& span, const std::string& name, const Array& array) {
  pass_
      .Error(span,
             "'" + name + "' is an array of " + std::to_string(array.length) + ", and no value")
      .Hint("its elements are values: " + name + "[0]; how many there are is sizeof(" + name + ")")
      .Note(array.span, "declared here");
  return Type::kError;
}

Type ArrayChecker::NoArray(const Span& span, const std::string& name, Type type) {
  if (type == Type::kError) return type;
  // A parameter has no type yet where its function is looked at before the calls.
  const Local* local = scope_.routine() != nullptr ? scope_.FindLocal(name) : nullptr;
  if (local != nullptr && local->parameter) {
    return pass_.Wrong(span, "'" + name + "' is a parameter, and no array",
                       "functions and commands take the elements of arrays, not arrays");
  }
  if (type == Type::kUnknown) return Type::kError;
  return pass_.Wrong(span, "'" + name + "' is no array, but " + NameOf(type),
                     "an array is declared by its values: " + name +
                         " = [0.0, 0.0], or by their number: " + name + "[8] = 0.0");
}

int ArrayChecker::KnownNumber(const Array& array, Expr* number, const std::string& name) {
  conversions_.Want(number, Type::kInt, "the number of an element");
  // What is no constant is looked at when the program runs; one that is wrong is an error here.
  const FoldResult known = Fold(*number);
  if (!known.value || known.value->type != Type::kInt) return -1;
  const int element = known.value->cell.AsInt();
  if (element >= 0 && element < array.length) return element;
  pass_.Error(number->span, "'" + name + "' has no element " + std::to_string(element))
      .Hint("its elements are 0 to " + std::to_string(array.length - 1))
      .Note(array.span, "declared here");
  return -1;
}

Type ArrayChecker::InferElement(Expr* element) {
  const Expr& named = *element->operands[0];
  const std::optional<Array> array = Find(named.name);
  if (!array) return Type::kUnknown;
  const int number = KnownNumber(*array, element->operands[1].get(), named.name);
  SetPlace(*array, number, element);
  return array->type;
}

bool ArrayChecker::InferSize(Expr* call) {
  const bool one = call->operands.size() == 2 && call->operands[1]->kind == ExprKind::kName;
  const std::optional<Array> array = one ? Find(call->operands[1]->name) : std::nullopt;
  if (!array) return false;
  // The operand means the array; the call is a number from here on.
  Expr& named = *call->operands[1];
  named.meaning = array->meaning;
  named.index = array->first;
  named.type = array->type;
  call->meaning = Meaning::kConstant;
  call->cell = vm::Cell::Int(array->length);
  return true;
}

void ArrayChecker::FindElement(const Array& array, Stmt* assignment) {
  const int number = KnownNumber(array, assignment->subscript.get(), assignment->name);
  SetPlace(array, number, assignment);
  assignment->type = array.type;
  // `+=` needs the number twice, which is computed once.
  if (number < 0 && assignment->op != Operator::kNone) {
    assignment->rest = scope_.Hidden("element", assignment->span, Type::kInt);
  }
}

Type ArrayChecker::InferValues(Expr* values) {
  Type type = Type::kUnknown;
  for (const ExprPtr& value : values->operands) {
    const std::optional<Type> joined = Join(type, value->type);
    if (!joined) {
      return pass_.Wrong(value->span, "the elements of an array are of one type, which is " +
                                          NameOf(type) + " here, but this is " +
                                          NameOf(value->type));
    }
    type = *joined;
  }
  return type == Type::kAny ? Type::kDirection : type;
}

}  // namespace morphbus::dynarole
