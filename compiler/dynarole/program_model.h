#pragma once
// A DynaRole program with everything inherited resolved into slots: what the checker works on and
// the code generator reads. Slots of a role are those of the role it extends, then its own.
// BuildModel makes it from the syntax tree, which must outlive it: roles and members are referred
// to and not copied. All lists are referred to by index, so they may grow.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "compiler/dynarole/ast.h"
#include "compiler/source/diagnostics.h"
#include "vm/image/program.h"

namespace morphbus::dynarole {

/// The events that handlers are named after, in the order of vm::Event.
inline constexpr const char* kEventNames[] = {"on_connect", "on_disconnect", "on_stall",
                                              "on_timer"};

/// A field of a role and all its subroles. There is one type for all of them, since code of the
/// base role works on the values of every subrole.
struct FieldDecl {
  std::string name;
  source::Span span;  ///< Where it was first declared.
  Type type = Type::kUnknown;
  /// The value that settled the type; a note points there where another value does not fit.
  source::Span type_span = {};
  /// Some code reads it; a field that nobody reads gets a warning.
  bool read = false;
  /// It is not declared where it begins: code there uses it, and all concrete subroles declare it.
  bool implied = false;
  /// Neighbours may read it.
  bool shared = false;
  /// Its value outlives a change of role or of program.
  bool kept = false;
  /// Of an element of an array: the array's name, how many elements it has, and which one it is.
  std::string array = {};
  int length = 0;
  int element = 0;

  /// Its name where it is declared, of an element that of the array.
  [[nodiscard]] const std::string& declared_name() const { return array.empty() ? name : array; }
};

/// A field as one role has it.
struct FieldSlot {
  /// Index into ProgramModel::fields.
  int decl = -1;
  /// The member that sets it, of this role or of one above it; null while the field is abstract.
  const Member* value = nullptr;
  /// The value, once the checker has evaluated it; it stands in the image.
  vm::Cell cell = {};
  /// The parameter whose value it is, by its index in ProgramModel::constants; -1 for none.
  int parameter = -1;
  /// Its value is told in every tick.
  bool traced = false;
};

/// A constant of the program or of a role, and of all roles that extend it.
struct ConstantModel {
  std::string name;
  source::Span span;  ///< Of its name where it is declared.
  Expr* expr = nullptr;
  /// Of a parameter: the ends of its range; null for a constant.
  Expr* least = nullptr;
  Expr* most = nullptr;
  int role = -1;  ///< The role in which it stands; -1: outside all.
  /// The checker sets the rest. Type and value, once it has been computed.
  Type type = Type::kUnknown;
  vm::Cell cell = {};
  vm::Cell least_cell = {}, most_cell = {};  ///< Of a parameter.
  /// Its value is being computed: if it is needed now, it rests on itself.
  bool busy = false;
  bool used = false;  ///< Some code or constant names it.
  /// Which of Program::enumerations it is a value of; -1 for none.
  int enumeration = -1;

  /// Whether a run may choose its value.
  [[nodiscard]] bool is_parameter() const { return least != nullptr; }
  /// "constant" or "parameter", as messages call it.
  [[nodiscard]] std::string Kind() const { return is_parameter() ? "parameter" : "constant"; }
};

/// What overriding routines share: types of parameters and result.
struct Signature {
  MemberKind kind = MemberKind::kFunction;
  std::string name;
  source::Span span;             ///< Of its name where it was first declared.
  std::vector<Type> parameters;  ///< kUnknown until the checker has found them.
  /// Whether the type of each parameter was found in a call, and not in a body.
  std::vector<bool> from_call;
  Type result = Type::kVoid;  ///< kVoid until a return with a value is found.
  /// Some code calls or invokes it.
  bool called = false;
};

/// A call of a function of the role that is played.
struct CallSite {
  /// Slot among the methods of the caller's role: which routine runs depends on the role that is
  /// played.
  int slot = -1;
  source::Span span;  ///< Of the function's name.
  /// The routine that `super` means; -1 for a call by slot.
  int routine = -1;
};

/// One function of the image: a requirement, a label, or a member with a body.
struct Routine {
  MemberKind kind = MemberKind::kFunction;
  int role = -1;  ///< The role that declares it.
  /// The member as parsed; the checker writes types and meanings into its tree.
  Member* member = nullptr;
  /// Index into ProgramModel::signatures for a member with a body; -1 for requirements and labels.
  int signature = -1;
  /// What a requirement (kBool) or a label (kJoint, kLink) evaluates to.
  Type result = Type::kVoid;
  std::string name;  ///< "LegUpperHalf.move_thigh".
  /// Types of the parameters, then of the variables. A slot is never used again for another
  /// variable.
  std::vector<Type> locals;
  std::vector<std::string> local_names;  ///< Of each of them, for people.
  std::vector<CallSite> calls;           ///< Those in its body, in order.
  /// The strongest effect of its own instructions and of all that it may call.
  vm::Effect effect = vm::Effect::kPure;
};

/// A member in one of a role's tables; its place there is its slot.
struct NamedSlot {
  std::string name;
  int routine = -1;  ///< Index into ProgramModel::routines.
};

/// The members of a role with all that it inherits. A subrole's tables begin with those of the role
/// it extends, with its own routines in place of those it overrides, so that code of the base role
/// finds them.
struct RoleMembers {
  std::vector<FieldSlot> fields;
  /// The joints and links that the role has names for.
  std::vector<NamedSlot> labels;
  /// Indices of routines, the base role's first: all of them must hold.
  std::vector<int> requirements;
  /// What runs: each kind has a table of its own, and so slots of its own.
  std::vector<NamedSlot> startups, behaviors, commands, handlers, methods;
};

/// A role and its members.
struct RoleModel : RoleMembers {
  Role* role = nullptr;  ///< The role as parsed.
  std::string name;
  int parent = -1;  ///< The role that it extends; -1: Module.
  /// The number of roles above it, Module not counted.
  int depth = 0;
  /// What it extends is not known, so that a name in it may be inherited: unknown names are not
  /// reported.
  bool broken = false;
};

/// A whole program; indices in it are places in its lists.
struct ProgramModel {
  /// The tree that this was made from.
  Program* program = nullptr;
  /// One for each role of the program, in its order.
  std::vector<RoleModel> roles;
  /// Every field once, whatever number of roles have it.
  std::vector<FieldDecl> fields;
  /// Those outside all roles and those of all roles.
  std::vector<ConstantModel> constants;
  /// Indices of the constants of a name, each in another role or outside all.
  std::map<std::string, std::vector<int>> constants_by_name;
  /// One for each set of routines that override each other.
  std::vector<Signature> signatures;
  /// The functions of the image, in its order.
  std::vector<Routine> routines;
  /// Indices into the keywords::KeywordTable of the keywords that the program uses, each once.
  std::vector<int> keywords;

  /// Index of the role, -1 if there is none of that name.
  [[nodiscard]] int FindRole(const std::string& name) const;
  /// Index of the constant of that name that code of the role sees, its own and inherited ones
  /// before those outside all roles (role -1); -1 if there is none.
  [[nodiscard]] int FindConstant(int role, const std::string& name) const;
  /// Index of the enumeration of that name in Program::enumerations; -1 if there is none.
  [[nodiscard]] int FindEnumeration(const std::string& name) const;
  /// Slot of the role's field of that name, -1 if it has none.
  [[nodiscard]] int FindField(const RoleModel& role, const std::string& name) const;
  /// Slot of the first element of the role's array of that name, -1 if it has none.
  [[nodiscard]] int FindArray(const RoleModel& role, const std::string& name) const;
  /// The field of that name which every concrete role that extends `base` has, as its first
  /// declarer declares it; null if one has none, which then is *without, or if there is no such
  /// role.
  const Member* FieldOfSubroles(int base, const std::string& name, const RoleModel** without) const;
  /// Whether a role is `ancestor` or extends it, directly or over others.
  [[nodiscard]] bool IsA(int role, int ancestor) const;
  /// Indices of all routines that its calls may reach, whichever subrole is played.
  [[nodiscard]] std::set<int> CalleesOf(const Routine& routine) const;
};

/// Slot of the name in one of a role's tables, -1 if there is none. Tables are short, so it looks
/// through them.
int FindSlot(const std::vector<NamedSlot>& slots, const std::string& name);

/// The table of a role that members of this kind stand in.
std::vector<NamedSlot>* SlotsOf(RoleModel* role, MemberKind kind);

/// Resolves `extends`, overriding and slots, and reports unknown roles, circles, duplicate members,
/// overriding that does not fit, and more members than a VM can hold. After such errors the model
/// is still whole enough to be checked, so that the user gets further errors in the same run.
/// @param program  must outlive the model, which points into it.
ProgramModel BuildModel(Program* program, source::Diagnostics* diagnostics);

}  // namespace morphbus::dynarole
