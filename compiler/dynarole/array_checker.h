#pragma once
// Arrays: variables and fields of several values of one type, which are told apart by number.

#include <optional>
#include <string>

#include "compiler/dynarole/conversions.h"

namespace morphbus::dynarole {

/// An array that a name means: its elements lie in slots behind each other.
struct Array {
  /// kLocal or kField: whose slots they are.
  Meaning meaning = Meaning::kNone;
  int first = -1;  ///< Slot of the first element.
  int length = 0;  ///< How many there are.
  Type type = Type::kUnknown;
  source::Span span;  ///< Where it was declared.
};

/// Finds arrays and their elements where names are used.
class ArrayChecker {
 public:
  /// All arguments must outlive it.
  ArrayChecker(ProgramModel* model, Scope* scope, Conversions* conversions, CheckPass* pass)
      : model_(*model), scope_(*scope), conversions_(*conversions), pass_(*pass) {}

  /// The array that a name means here, which counts as used then; nothing if it means none.
  std::optional<Array> Find(const std::string& name);
  /// `NAME[number]`, whose number has its type: the type of the element. Where the name means no
  /// array there is an error that says so, and kError.
  Type InferElement(Expr* element);
  /// `sizeof(NAME)` of an array is a constant; false if the operand is none.
  bool InferSize(Expr* call);
  /// Which element of an array an assignment sets, whose number has its type.
  void FindElement(const Array& array, Stmt* assignment);
  /// Reports an array that stands where one value is wanted. Returns kError.
  Type AsValue(const source::Span& span, const std::string& name, const Array& array);
  /// Reports that what a name means has no elements. Returns kError.
  Type NoArray(const source::Span& span, const std::string& name, Type type);
  /// The type that all elements of an array have that begins with these values.
  Type InferValues(Expr* values);

 private:
  /// The number of the element if it is known: -1 if not, or if it was reported to be none.
  int KnownNumber(const Array& array, Expr* number, const std::string& name);

  ProgramModel& model_;
  Scope& scope_;
  Conversions& conversions_;
  CheckPass& pass_;
};

}  // namespace morphbus::dynarole
