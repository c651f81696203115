#pragma once
// The table of roles: everything inherited is written out in it, so each role must be checked to
// agree with the one that it extends; code compiled for a role then runs under all its subroles.

#include <cstdint>

#include "vm/image/program.h"
#include "vm/image/role_tree.h"
#include "vm/image/verify_error.h"

namespace morphbus::vm {

/// Checks the roles of a program whose functions, constants and keywords are sound. Each step
/// returns false after it has noted an error, and relies on those before it.
class RoleChecker {
 public:
  /// Both must outlive the checker.
  RoleChecker(const VerifiedProgram& program, FirstError* error)
      : program_(program), bytes_(program.bytes()), error_(*error) {}

  /// The record of one role by itself: its head, counts and members. Roles have no fixed size, so
  /// `at` moves from where the record begins, of which the program must know, to behind it.
  bool CheckRecord(int index, uint32_t* at);
  /// Roles extend each other without circles.
  bool CheckDepths();
  /// Every role agrees with the one that it extends. Slots are shared: what a parent has in a slot,
  /// its subroles have there too, of the same type.
  bool CheckInheritance();
  /// A function reads fields and labels by its owner's slots, so a role may use only functions of
  /// its own and of the roles that it extends, those that it inherits included.
  bool CheckOwners(const RoleTree& tree);

 private:
  /// What a role's reference to a function must fit.
  enum class Member : uint8_t { kRequirement, kRoutine, kCommand, kMethod };

  // Members of one kind, whose records begin at `at`, which moves behind them.
  bool CheckFields(const RoleInfo& role, uint32_t* at);
  bool CheckLabels(const RoleInfo& role, uint32_t* at);
  bool CheckReferences(const ReferenceTable& functions, int count, Member member, uint32_t* at);
  bool CheckHandlers(const RoleInfo& role, uint32_t* at);
  /// The constant that is the period of a timer.
  bool CheckPeriod(int constant, uint32_t at);
  bool CheckAgainstParent(const RoleInfo& role, const RoleInfo& parent);
  /// True if two functions take and return the same types, so that calls of one may reach the
  /// other.
  [[nodiscard]] bool SameSignature(int function, int other) const;
  /// True if the functions in the first `count` slots of two tables are alike in that way.
  [[nodiscard]] bool SameSignatures(const ReferenceTable& functions, const ReferenceTable& others,
                                    int count) const;
  /// Notes an error of the table as a whole.
  bool FailTable(const char* message);

  const VerifiedProgram& program_;
  const uint8_t* bytes_;
  FirstError& error_;
};

}  // namespace morphbus::vm
