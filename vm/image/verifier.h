#pragma once
// Turns untrusted bytes into a VerifiedProgram, once, in linear time.

#include <cstdint>

#include "vm/image/program.h"

namespace morphbus::vm {

/// Why an image was refused.
struct VerifyError {
  /// What is wrong, as a constant text; nullptr if the image was accepted.
  const char* message = nullptr;
  /// The byte of the image at which it was noticed.
  uint32_t offset = 0;
};

/// One verification. Its steps stand in three files, in the order in which they run; each returns
/// false after it has noted the first error. Later steps rely on what earlier ones have proved.
class Verifier {
 public:
  /// Checks `bytes` (header, hash, every table, every instruction: jumps, stack depth, types,
  /// arity, bounded call depth, finite numbers) and fills `out`, which then refers to `bytes`. On
  /// error `out` is left empty (size() == 0).
  static VerifyError Verify(const uint8_t* bytes, uint32_t size, VerifiedProgram* out);

 private:
  Verifier(const uint8_t* bytes, uint32_t size, VerifiedProgram* out)
      : bytes_(bytes), size_(size), out_(*out) {}

  /// What the abstract interpretation of one function holds at an instruction.
  struct StackState {
    /// The types of the operands, the bottom first, of which `depth` are in use.
    ValueType types[kStackCells] = {};
    int depth = 0;
    /// A bit for each local that has been set.
    uint16_t set_locals = 0;
  };
  /// The joins of one function, walked in step with its code: where they begin in the image, and
  /// how many there are.
  struct JoinTable {
    uint32_t begin = 0;
    int count = 0;
  };

  /// Notes an error, at this byte, unless one is noted already; returns false.
  bool Fail(const char* message, uint32_t offset);

  // Tables (verifier.cc): header, sections, texts, keywords, constants, functions, joins, lines.
  /// All steps in order; the others below are run by it.
  bool Run();
  /// Magic, version, size, hash, and an instruction budget that lets programs run.
  bool CheckHeader();
  /// The sections follow each other without gaps and fill the image.
  bool CheckSections();
  /// A text lies within the strings and has no control characters; fills it in.
  bool CheckText(uint32_t at, Text* text);
  /// Kinds of keywords, and values of constants.
  bool CheckKeywords();
  bool CheckConstants();
  /// Signatures, types of locals, and where each function's code lies.
  bool CheckFunctions();
  bool CheckFunction(int index, uint32_t at);
  /// The joins of each function in order, then the function's code (CheckCode).
  bool CheckJoins();
  /// Lines belong to instructions and are sorted.
  bool CheckLines();

  // Roles (verifier_roles.cc). `at` moves on from record to record.
  /// The whole table; the checks of its parts follow.
  bool CheckRoles();
  /// One role: its head, and then its members by the functions below.
  bool CheckRoleHead(int index, uint32_t* at);
  bool CheckFields(RoleInfo* role, uint32_t* at);
  bool CheckLabels(RoleInfo* role, uint32_t* at);
  bool CheckRoutines(RoutineInfo* routines, int count, bool is_command, uint32_t* at);
  bool CheckHandlers(RoleInfo* role, uint32_t* at);
  bool CheckFunctionRefs(uint16_t* functions, int count, bool is_requirement, uint32_t* at);
  /// Roles extend each other without circles, and agree with what they extend.
  bool CheckParents();
  bool CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent);
  /// A role uses only functions that stand in itself or in a role that it extends.
  bool CheckOwners();
  /// Finds the keywords that the role's functions use; never fails.
  void CollectKeywords(int index);
  /// True if two functions take and return the same types.
  [[nodiscard]] bool SameSignature(int function, int other) const;

  // Code (verifier_code.cc): one pass over each function, with the types on the stack as state.
  /// One function: every instruction is reachable, whole and fed with operands of its types.
  bool CheckCode(int index);
  /// One instruction, whose effect on the types goes to `state`; *ends is set if nothing follows
  /// it.
  bool CheckInstruction(int index, const JoinTable& joins, const uint8_t* code, StackState* state,
                        bool* ends);
  /// Locals, slots, jumps, calls and returns: what the table's letters cannot say.
  bool CheckVariable(int index, uint8_t op, uint32_t operand, StackState* state);
  bool CheckSlot(int index, uint8_t op, uint32_t operand, StackState* state);
  bool CheckJump(const JoinTable& joins, uint8_t op, uint32_t target, StackState* state);
  bool CheckCallOut(int index, uint8_t op, const uint8_t* operand, StackState* state);
  bool CheckReturn(int index, uint8_t op, StackState* state);
  /// All other instructions, by the letters of vm/image/opcodes.def.
  bool CheckBySignature(int index, uint8_t op, uint32_t operand, StackState* state);
  /// `==` and `!=`: two operands of one type that can be compared by their bits.
  bool CheckSame(StackState* state);
  /// What arrives at a join fits what the image states there; LoadJoin goes on with the statement.
  bool LeadsTo(uint32_t join, const StackState& state);
  void LoadJoin(uint32_t join, StackState* state) const;
  /// Steps of the abstract stack.
  bool PopType(ValueType type, StackState* state);
  bool PopAny(ValueType* type, StackState* state);
  bool PushType(ValueType type, StackState* state);
  bool PopArguments(int function, StackState* state);

  // Calls (verifier_code.cc): no circles, bounded depth, effects only where they are allowed.
  /// No recursion, bounded depth and cells; VisitCalls goes through what a function may call.
  bool CheckCalls();
  bool VisitCalls(int function, int depth);
  bool VisitCallees(int function, int slot, int depth);
  /// Requirements and labels run pure instructions only.
  bool CheckEffects();
  /// The role in whose braces a function stands.
  [[nodiscard]] int OwnerOf(int function) const;

  const uint8_t* bytes_;
  uint32_t size_;
  VerifiedProgram& out_;
  VerifyError error_;
  /// The byte that code checks complain about.
  uint32_t at_ = 0;
  /// For each role, the bits of itself and of those that it extends.
  uint64_t ancestors_[kMaxRoles] = {};
  /// For each function: the bits of the keywords that it names, and of the slots that it calls.
  uint64_t keywords_used_[kMaxFunctions] = {};
  uint16_t methods_called_[kMaxFunctions] = {};
  /// For each function: the strongest Effect of all that it may run.
  uint8_t effects_[kMaxFunctions] = {};
  /// For each function: 0 if it is new, 1 while it is being visited, 2 when it is done.
  uint8_t visits_[kMaxFunctions] = {};
};

}  // namespace morphbus::vm
