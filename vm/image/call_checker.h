#pragma once
// Who calls whom: no circles, bounded depth and cells, effects only where they are allowed.

#include <cstdint>

#include "vm/image/code_facts.h"
#include "vm/image/program.h"
#include "vm/image/role_tree.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// Follows the calls of a program whose code has been checked. Every function, and every slot of
/// every role, is visited once, so this is linear in functions and table.
class CallChecker {
 public:
  /// All arguments must outlive the checker. `facts` are those of all functions, by their numbers;
  /// each also gets the keywords of the function that it calls as the one it replaces, which may
  /// stand in no table of a role that uses the caller.
  CallChecker(const VerifiedProgram& program, const RoleTree& tree, CodeFacts* facts,
              FirstError* error)
      : program_(program), tree_(tree), facts_(facts), error_(*error) {}

  /// Calls go through the role's slots, so a call may reach the function of any subrole. No
  /// recursion can be, and the depth and cells that any task can need are bounded here, once. False
  /// after it has noted an error.
  bool CheckCalls();
  /// Requirements and labels are evaluated whenever the surroundings change, so they must not act:
  /// all that they may run is pure. CheckCalls must have found no error.
  bool CheckEffects();

 private:
  /// How far a visit has come; what is met again while it is being visited calls itself.
  enum Visit : uint8_t { kNew, kVisiting, kDone };
  /// The most of all that a function may reach, itself included, or a slot of a role and of all
  /// roles that extend it.
  struct Reach {
    /// Cells that locals and operands need.
    uint16_t cells : 7 = 0;
    /// Frames below this one.
    uint16_t call_depth : 4 = 0;
    /// The strongest Effect.
    uint16_t effect : 2 = 0;
    uint16_t visit : 2 = kNew;
  };
  static_assert(kStackCells < 128 && kMaxCallDepth < 16);

  /// Goes through what a function may call, at this depth of calls.
  bool VisitFunction(int function, int depth);
  /// The same through a slot of a role and of all that extend it.
  bool VisitSlot(int top, int slot, int depth);
  static void Raise(Reach* most, const Reach& reach);

  const VerifiedProgram& program_;
  const RoleTree& tree_;
  CodeFacts* facts_;
  FirstError& error_;
  Reach functions_[kMaxFunctions];
  Reach slots_[kMaxRoles][kMaxRoutines];
};

}  // namespace morphbus::vm
