#pragma once
// Turns untrusted bytes into a VerifiedProgram, once, in linear time.

#include <cstdint>

#include "vm/image/opcodes.h"
#include "vm/image/program.h"

namespace morphbus::vm {

/// Why an image was refused.
struct VerifyError {
  /// What is wrong, as a constant text; nullptr if the image was accepted.
  const char* message = nullptr;
  /// The byte of the image at which it was noticed.
  uint32_t offset = 0;
};

/// One verification. Its steps stand in six files, and Run() calls them in order; each returns
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
  /// What the operand of an instruction names.
  struct Named {
    /// The type of what each part names; kVoid where it is no value.
    ValueType types[kMostParts] = {};
    /// The type of the second of two values that are compared, once it has been popped.
    ValueType compared = ValueType::kVoid;
    /// The function that is called, the text, or the place of the join's record: no operand names
    /// two of these.
    uint32_t number = 0;
  };
  /// What is found out about one function on the way.
  struct FunctionFacts {
    /// The bits of the keywords that it names, and of the slots that it calls.
    uint64_t keywords = 0;
    uint16_t methods_called = 0;
    /// One more than the function that it calls as the one it replaces; 0 if it calls none.
    uint16_t super_called = 0;
    /// The most cells that the locals and operands of this function and all it calls need.
    uint8_t total_cells = 0;
    /// The most operand cells that it needs itself.
    uint8_t max_stack = 0;
    /// The most frames below this one.
    uint8_t call_depth = 0;
    /// The strongest Effect of all that it may run.
    uint8_t effect : 4 = 0;
    /// 0 if it is new, 1 while it is being visited, 2 when it is done.
    uint8_t visit : 4 = 0;
  };
  /// The most of all that a call may reach: FunctionFacts by the same names.
  struct CallFacts {
    uint16_t cells : 7 = 0;
    uint16_t call_depth : 4 = 0;
    uint16_t effect : 4 = 0;
    /// Of a role's slot: it is known for the role and all that extend it.
    uint16_t done : 1 = 0;
  };
  static_assert(kStackCells < 128 && kMaxCallDepth < 16 && kMaxRoles < 255);
  static constexpr uint8_t kNoRole = 255;
  /// What a role's reference to a function must fit.
  enum class Member : uint8_t { kRequirement, kRoutine, kCommand, kMethod };

  /// Notes an error, at this byte, unless one is noted already; returns false. A microcontroller
  /// says only where: the same image refused on a host says why.
  bool Fail(const char* message, uint32_t offset) {
    if constexpr (!kHoldsNotes) return Refuse(offset);
    return Note(message, offset);
  }
  bool Note(const char* message, uint32_t offset);
  bool Refuse(uint32_t offset);

  // Tables (verifier.cc): header, sections, texts, keywords, constants, functions, joins.
  /// All steps in order; the others below are run by it.
  bool Run();
  /// Magic, version, size, hash, and an instruction budget that lets programs run.
  bool CheckHeader();
  /// The sections follow each other without gaps and fill the image.
  bool CheckSections();
  /// A text lies within the strings that begin at `strings`, and has no control characters; `at` is
  /// its record.
  bool CheckText(uint32_t strings, uint32_t count, uint32_t offset, uint32_t size, uint32_t at);
  /// The text record of a name, which is not empty.
  bool CheckName(uint32_t at);
  /// Kinds of keywords, and values of constants.
  bool CheckKeywords();
  bool CheckConstants();
  /// Signatures, types of locals, and where each function's code lies.
  bool CheckFunctions();
  bool CheckFunction(int index, uint32_t at);
  /// All states and joins, then each function's code (CheckCode).
  bool CheckJoins();

  // Notes (verifier_notes.cc).
  /// Those that the header names, or none.
  bool CheckNotes();
  bool CheckNames(uint32_t notes, uint32_t strings, uint32_t names, uint32_t count);
  bool CheckLines(uint32_t begin, uint32_t count);

  // Roles (verifier_roles.cc). `at` moves on from record to record.
  /// The whole table; the checks of its parts follow.
  bool CheckRoles();
  /// One role: its head, and then its members by the functions below.
  bool CheckRoleHead(int index, uint32_t* at);
  bool CheckFields(const RoleInfo& role, uint32_t* at);
  bool CheckLabels(const RoleInfo& role, uint32_t* at);
  bool CheckReferences(const ReferenceTable& functions, int count, Member member, uint32_t* at);
  bool CheckHandlers(const RoleInfo& role, uint32_t* at);
  bool CheckPeriod(int constant, uint32_t at);
  /// Roles extend each other without circles, and agree with what they extend.
  bool CheckParents();
  /// Which roles extend each other, and so the ancestors of each.
  void PlantTree();
  /// The role after this one among those below `top`, each before those that extend it; -1: none.
  [[nodiscard]] int NextBelow(int role, int top) const;
  bool CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent);
  /// A role uses only functions that stand in itself or in a role that it extends.
  bool CheckOwners();
  /// Finds the keywords that the role's functions use; never fails.
  void CollectKeywords(int index);
  /// True if two functions take and return the same types.
  [[nodiscard]] bool SameSignature(int function, int other) const;

  // Code (verifier_code.cc): one pass over each function, with the types on the stack as state.
  /// One function: every instruction is reachable, whole and fed with operands of its types.
  bool CheckCode(int index, uint32_t* next_join);
  /// One instruction of the function `index`, whose effect on the types goes to `state`.
  bool CheckInstruction(int index, const FunctionInfo& function, const uint8_t* code,
                        StackState* state);
  /// The join to which a target leads: the place of its record goes to `join`.
  bool FindJoin(const FunctionInfo& function, uint32_t target, uint32_t* join);
  /// What arrives at a join fits what the image states there; LoadJoin goes on with the statement.
  bool LeadsTo(uint32_t join, const StackState& state);
  void LoadJoin(uint32_t join, StackState* state) const;
  [[nodiscard]] uint32_t StateOf(uint32_t join) const;

  // Operands and the stack (verifier_operands.cc), as vm/image/operands.def and the letters of
  // vm/image/opcodes.def say.
  /// What the parts of an operand name exists, and goes to `named`; `at` is the operand's first
  /// byte. CheckPart and CheckTypeOfPart do so for one part.
  bool CheckOperand(int index, const FunctionInfo& function, OperandKind kind, const uint8_t* at,
                    StackState* state, Named* named);
  bool CheckPart(int index, const FunctionInfo& function, OperandPart part, const uint8_t* at,
                 StackState* state, Named* named);
  bool CheckTypeOfPart(OperandPart part, ValueType type);
  bool CheckKeyword(int index, OperandPart part, uint32_t number);
  bool CheckSuper(int index, uint32_t callee);
  /// What the instruction takes from the stack, by its letters, and what it leaves there.
  bool Take(const FunctionInfo& function, const OpcodeInfo& info, Named* named, StackState* state);
  bool PopTerm(const FunctionInfo& function, Term term, Named* named, StackState* state);
  bool Leave(const OpcodeInfo& info, const Named& named, StackState* state);
  /// True for types whose values are the same if their bits are.
  [[nodiscard]] static bool IsComparable(ValueType type);
  /// Steps of the abstract stack.
  bool PopType(ValueType type, StackState* state);
  bool PopAny(ValueType* type, StackState* state);
  bool PushType(ValueType type, StackState* state);
  bool PopArguments(int function, StackState* state);
  /// The values that a text has places for.
  bool PopPlaces(int text, StackState* state);

  // Calls (verifier_calls.cc): no circles, bounded depth, effects only where they are allowed.
  /// No recursion, bounded depth and cells; VisitCalls goes through what a function may call, at
  /// this depth of calls, and VisitSlot through a slot of a role and of all that extend it.
  bool CheckCalls();
  bool VisitCalls(int function, int depth);
  bool VisitSlot(int top, int slot, int depth);
  static void Raise(CallFacts* most, const CallFacts& facts);
  [[nodiscard]] CallFacts FactsOf(int function) const;
  /// Requirements and labels run pure instructions only.
  bool CheckEffects();
  /// The role in whose braces a function stands.
  [[nodiscard]] int OwnerOf(int function) const;

  const uint8_t* bytes_;
  /// Bytes of the part that runs, once the header has been read, and of all.
  uint32_t size_;
  uint32_t total_ = 0;
  VerifiedProgram& out_;
  VerifyError error_;
  /// The byte that code checks complain about.
  uint32_t at_ = 0;
  /// For each role, the bits of itself and of those that it extends.
  uint64_t ancestors_[kMaxRoles] = {};
  /// The roles as a tree: of those that extend a role the first, and of those that extend the same
  /// one the next.
  uint8_t first_child_[kMaxRoles];
  uint8_t next_sibling_[kMaxRoles];
  FunctionFacts facts_[kMaxFunctions];
  CallFacts slots_[kMaxRoles][kMaxRoutines];
};

}  // namespace morphbus::vm
