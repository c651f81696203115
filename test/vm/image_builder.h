#pragma once
// Images written by hand, by another route than the compiler's writer, so that each test can break
// exactly one thing.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "vm/image/opcodes.h"
#include "vm/image/program.h"

namespace morphbus::vm {

using Code = std::vector<uint8_t>;

/// One instruction with its operand bytes.
inline Code Op(Opcode op, std::vector<int> operands = {}) {
  Code code = {static_cast<uint8_t>(op)};
  for (const int operand : operands) code.push_back(static_cast<uint8_t>(operand));
  return code;
}
/// What ends a function.
const Code kLeave = Op(Opcode::kReturn);

/// A jump to a byte offset, or a constant's index.
inline Code Op16(Opcode op, int operand) { return Op(op, {operand & 255, operand >> 8}); }

inline Code operator+(Code a, const Code& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct TestJoin {
  int offset = 0;
  int set_locals = 0;
  std::vector<ValueType> stack;
};

struct TestFunction {
  std::string name = "R.go";
  int role = 0;
  ValueType return_type = ValueType::kVoid;
  int num_arguments = 0;
  std::vector<ValueType> locals;
  Code code;
  std::vector<TestJoin> joins;
};

struct TestField {
  ValueType type = ValueType::kInt;
  uint32_t bits = 0;
};

struct TestRole {
  std::string name = "R";
  int parent = -1;
  int depth = 0;
  bool abstract_role = false;
  std::vector<TestField> fields;
  std::vector<std::pair<ValueType, int>> labels;
  std::vector<int> requirements, startups, behaviors, commands, methods;
  std::vector<std::pair<int, int>> handlers;
};

/// A whole image; by default one role R whose startup, function 0, must be given code.
struct TestImage {
  std::string source_name = "test.dyn";
  std::vector<std::pair<KeywordKind, std::string>> keywords;
  std::vector<std::pair<ValueType, uint32_t>> constants;
  std::vector<TestFunction> functions = {TestFunction{}};
  std::vector<TestRole> roles = {TestRole{}};
  std::vector<std::pair<int, int>> lines;  ///< Offset in the code section, line.
  uint32_t budget = 20000;

  TestImage() { roles[0].startups = {0}; }
  /// A function of R with this code as the only startup.
  explicit TestImage(Code code) : TestImage() { functions[0].code = std::move(code); }

  [[nodiscard]] std::vector<uint8_t> Build() const;
};

/// An image of this startup, whose role has a method of this kind and of the name f in slot 0.
TestImage WithMethod(const Code& startup, TestFunction method);

/// Makes the hash fit again after bytes were changed.
void Rehash(std::vector<uint8_t>* image);

/// The verifier's message; "" if it accepts.
std::string VerifyMessage(const std::vector<uint8_t>& image);

/// The float's bits.
uint32_t Bits(float value);

}  // namespace morphbus::vm
