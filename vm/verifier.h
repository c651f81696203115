#pragma once
// Turns untrusted bytes into a VerifiedProgram, once, in linear time.

#include <cstdint>

#include "vm/program.h"

namespace morphbus::vm {

struct VerifyError {
  const char* message = nullptr;  ///< nullptr: accepted.
  uint32_t offset = 0;            ///< Byte of the image at which it was noticed.
};

class Verifier {
 public:
  /// Checks `bytes` (header, hash, every table, every instruction: jumps, stack depth, types,
  /// arity, bounded call depth, finite numbers) and fills `out`, which then refers to `bytes`. On
  /// error `out` is left empty (size() == 0).
  static VerifyError Verify(const uint8_t* bytes, uint32_t size, VerifiedProgram* out);

 private:
  Verifier(const uint8_t* bytes, uint32_t size, VerifiedProgram* out)
      : bytes_(bytes), size_(size), out_(*out) {}

  // What the abstract interpretation of one function holds at an instruction.
  struct StackState {
    ValueType types[kStackCells] = {};
    int depth = 0;
    uint16_t set_locals = 0;  ///< Bits of the locals that have been set.
  };
  // The joins of one function, walked in step with its code.
  struct JoinTable {
    uint32_t begin = 0;
    int count = 0;
  };

  bool Fail(const char* message, uint32_t offset);

  // Tables (verifier.cc).
  bool Run();
  bool CheckHeader();
  bool CheckSections();
  bool CheckText(uint32_t at, Text* text);
  bool CheckKeywords();
  bool CheckConstants();
  bool CheckFunctions();
  bool CheckFunction(int index, uint32_t at);
  bool CheckJoins();
  bool CheckLines();

  // Roles (verifier_roles.cc).
  bool CheckRoles();
  bool CheckRoleHead(int index, uint32_t* at);
  bool CheckFields(RoleInfo* role, uint32_t* at);
  bool CheckLabels(RoleInfo* role, uint32_t* at);
  bool CheckRoutines(RoutineInfo* routines, int count, bool is_command, uint32_t* at);
  bool CheckHandlers(RoleInfo* role, uint32_t* at);
  bool CheckFunctionRefs(uint16_t* functions, int count, bool is_requirement, uint32_t* at);
  bool CheckParents();
  bool CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent);
  bool CheckOwners();
  bool CheckOwnersOf(int index);
  void CollectKeywords(int index);
  [[nodiscard]] bool SameSignature(int function, int other) const;

  // Code (verifier_code.cc).
  bool CheckCode(int index);
  bool CheckInstruction(int index, const JoinTable& joins, const uint8_t* code, StackState* state,
                        bool* ends);
  bool CheckVariable(int index, uint8_t op, uint32_t operand, StackState* state);
  bool CheckSlot(int index, uint8_t op, uint32_t operand, StackState* state);
  bool CheckJump(const JoinTable& joins, uint8_t op, uint32_t target, StackState* state);
  bool CheckCallOut(int index, uint8_t op, const uint8_t* operand, StackState* state);
  bool CheckReturn(int index, uint8_t op, StackState* state);
  bool CheckBySignature(int index, uint8_t op, uint32_t operand, StackState* state);
  bool CheckSame(StackState* state);
  bool LeadsTo(uint32_t join, const StackState& state);
  void LoadJoin(uint32_t join, StackState* state) const;
  bool PopType(ValueType type, StackState* state);
  bool PopAny(ValueType* type, StackState* state);
  bool PushType(ValueType type, StackState* state);
  bool PopArguments(int function, StackState* state);

  // Calls (verifier_code.cc).
  bool CheckCalls();
  bool VisitCalls(int function, int depth);
  bool VisitCallees(int function, int slot, int depth);
  bool CheckEffects();
  [[nodiscard]] int OwnerOf(int function) const;

  const uint8_t* bytes_;
  uint32_t size_;
  VerifiedProgram& out_;
  VerifyError error_;
  uint32_t at_ = 0;                     ///< Byte that code checks complain about.
  uint64_t ancestors_[kMaxRoles] = {};  ///< Bits of each role and those it extends.
  uint64_t keywords_used_[kMaxFunctions] = {};
  uint16_t methods_called_[kMaxFunctions] = {};
  uint8_t effects_[kMaxFunctions] = {};  ///< Effect.
  uint8_t visits_[kMaxFunctions] = {};   ///< 0 new, 1 being visited, 2 done.
};

}  // namespace morphbus::vm
