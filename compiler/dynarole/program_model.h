#pragma once
// A DynaRole program with everything inherited resolved into slots: what the checker works on and
// the code generator reads. Slots of a role are those of the role it extends, then its own.

#include <optional>
#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/source/diagnostics.h"
#include "vm/program.h"

namespace morphbus::dynarole {

/// A field of a role and all its subroles; one type for all of them.
struct FieldDecl {
  std::string name;
  source::Span span;  ///< Where it was first declared.
  Type type = Type::kUnknown;
  source::Span type_span;  ///< The value that settled the type.
  bool read = false;
};

struct FieldSlot {
  int decl = -1;
  const Member* value = nullptr;  ///< The member that sets it; null while it is abstract.
  vm::Cell cell;                  ///< Its value, once checked.
};

/// What overriding routines share: types of parameters and result.
struct Signature {
  MemberKind kind = MemberKind::kFunction;
  std::string name;
  source::Span span;
  std::vector<Type> parameters;
  std::vector<bool> from_call;  ///< The type was found in a call, not in a body.
  Type result = Type::kVoid;
  bool called = false;
};

struct CallSite {
  int slot = -1;  ///< Method slot of the caller's role.
  source::Span span;
};

/// One function of the image: a requirement, a label, or a member with a body.
struct Routine {
  MemberKind kind = MemberKind::kFunction;
  int role = -1;  ///< The role that declares it.
  Member* member = nullptr;
  int signature = -1;         ///< Of members with a body.
  Type result = Type::kVoid;  ///< kBool, kJoint, kLink of requirements and labels.
  std::string name;           ///< "LegUpperHalf.move_thigh".
  std::vector<Type> locals;   ///< Parameters first; slots are never reused.
  std::vector<CallSite> calls;
  vm::Effect effect = vm::Effect::kPure;
};

struct NamedSlot {
  std::string name;
  int routine = -1;
};

struct RoleModel {
  Role* role = nullptr;
  std::string name;
  int parent = -1;
  int depth = 0;
  bool broken = false;  ///< What it extends is not known; names in it are not complained of.
  std::vector<FieldSlot> fields;
  std::vector<NamedSlot> labels;
  std::vector<int> requirements;  ///< Routines.
  std::vector<NamedSlot> startups, behaviors, commands, handlers, methods;
};

struct ProgramModel {
  Program* program = nullptr;
  std::vector<RoleModel> roles;
  std::vector<FieldDecl> fields;
  std::vector<Signature> signatures;
  std::vector<Routine> routines;
  std::vector<int> keywords;  ///< Keywords used: indices into the KeywordTable.

  [[nodiscard]] int FindRole(const std::string& name) const;
  [[nodiscard]] bool IsA(int role, int ancestor) const;
};

/// Slot of the name, -1 if there is none.
int FindSlot(const std::vector<NamedSlot>& slots, const std::string& name);

/// The table of a role that members of this kind stand in.
std::vector<NamedSlot>* SlotsOf(RoleModel* role, MemberKind kind);

/// Resolves `extends`, overriding and slots, and reports unknown roles, circles, duplicate members,
/// overriding that does not fit, and more members than a VM can hold.
ProgramModel BuildModel(Program* program, source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
