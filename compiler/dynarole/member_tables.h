#pragma once
// The tables of a role's members, which begin with those that it inherits.

#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {

/// Puts members into the tables of the roles that declare them.
class MemberTables {
 public:
  /// Both arguments must outlive it.
  MemberTables(ProgramModel* model, source::Diagnostics* diagnostics)
      : model_(*model), diagnostics_(*diagnostics) {}

  /// Puts a member into the table of its kind, in the place of what it replaces or behind all
  /// others. The role (its index) has what it inherits already. A member that fits none of what is
  /// inherited under its name is reported and left out.
  void Add(int role, Member* member);

 private:
  /// Whether a constant of the role or above it has the member's name, which is reported.
  bool IsConstant(int role, const Member& member);
  /// A name means one kind of member in a role and all roles that extend it; reports if not.
  bool FitsInherited(const RoleModel& role, const Member& member);
  /// Whether a handler's name is that of an event, or it is a timer; reports if not.
  bool IsEvent(const Member& member);
  /// Handlers may take what their event is about, and nothing else; reports if not.
  bool TakesSubject(Member* member);
  void AddField(RoleModel* role, const Member& member);
  /// A field is one value or as many as before in all roles that have it; reports if not.
  bool FitsInheritedLength(const RoleModel& role, const Member& member);
  /// Whether a member may replace the inherited one with this signature; reports why not.
  bool Overrides(const Member& member, int signature);
  int AddSignature(const Member& member);
  /// Makes the function of the image for a member, and returns its index.
  int AddRoutine(int role, Member* member, int signature);

  ProgramModel& model_;
  source::Diagnostics& diagnostics_;
};

}  // namespace morphbus::dynarole
