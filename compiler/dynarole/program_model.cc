#include "compiler/dynarole/program_model.h"

#include <algorithm>

namespace morphbus::dynarole {

namespace {

/// The index of the first item that fits; -1 if none does.
template <typename T, typename Fits>
int IndexOf(const std::vector<T>& items, const Fits& fits) {
  const auto found = std::ranges::find_if(items, fits);
  return found == items.end() ? -1 : static_cast<int>(found - items.begin());
}

}  // namespace

int ProgramModel::FindRole(const std::string& name) const {
  return IndexOf(roles, [&](const RoleModel& role) { return role.name == name; });
}

const Member* ProgramModel::FieldOfSubroles(int base, const std::string& name,
                                            const RoleModel** without) const {
  const Member* found = nullptr;
  for (int r = 0; r < std::ssize(roles); ++r) {
    // Abstract roles are played by nobody, so that they need not have it.
    if (r == base || roles[r].role->abstract_role || !IsA(r, base)) continue;
    // In the role itself, or between it and the base.
    const Member* own = nullptr;
    for (int above = r; above != base && own == nullptr; above = roles[above].parent) {
      for (const Member& member : roles[above].role->members) {
        if (member.kind == MemberKind::kField && member.name == name) own = &member;
      }
    }
    if (own == nullptr) {
      if (without != nullptr) *without = &roles[r];
      return nullptr;
    }
    if (found == nullptr) found = own;
  }
  return found;
}

int ProgramModel::FindConstant(int role, const std::string& name) const {
  const auto named = constants_by_name.find(name);
  if (named == constants_by_name.end()) return -1;
  // No two of a name lie on one chain of roles, so that at most one is inherited.
  int outside = -1;
  for (const int index : named->second) {
    if (constants[index].role < 0) outside = index;
    if (constants[index].role >= 0 && IsA(role, constants[index].role)) return index;
  }
  return outside;
}

int ProgramModel::FindEnumeration(const std::string& name) const {
  return IndexOf(program->enumerations,
                 [&](const Enumeration& enumeration) { return enumeration.name == name; });
}

int ProgramModel::FindField(const RoleModel& role, const std::string& name) const {
  return IndexOf(role.fields,
                 [&](const FieldSlot& slot) { return fields[slot.decl].name == name; });
}

int ProgramModel::FindArray(const RoleModel& role, const std::string& name) const {
  return IndexOf(role.fields, [&](const FieldSlot& slot) {
    return !name.empty() && fields[slot.decl].array == name;
  });
}

std::set<int> ProgramModel::CalleesOf(const Routine& routine) const {
  std::set<int> slots, callees;
  // A call names a slot, and each subrole may have a function of its own there.
  for (const CallSite& call : routine.calls) {
    if (call.routine >= 0) callees.insert(call.routine);
    if (call.routine < 0) slots.insert(call.slot);
  }
  // Code of a role runs under all its subroles, and under no other role.
  for (int role = 0; role < std::ssize(roles); ++role) {
    if (!IsA(role, routine.role)) continue;
    for (const int slot : slots) callees.insert(roles[role].methods[slot].routine);
  }
  return callees;
}

bool ProgramModel::IsA(int role, int ancestor) const {
  // BuildModel has cut all circles, so the chain ends.
  while (role >= 0 && role != ancestor) role = roles[role].parent;
  return role >= 0;
}

int FindSlot(const std::vector<NamedSlot>& slots, const std::string& name) {
  // Names are unique in a table.
  return IndexOf(slots, [&](const NamedSlot& slot) { return slot.name == name; });
}

std::vector<NamedSlot>* SlotsOf(RoleModel* role, MemberKind kind) {
  // In the order of MemberKind; fields and requirements have tables of other types.
  constexpr std::vector<NamedSlot> RoleMembers::*kTables[] = {nullptr,
                                                              &RoleMembers::labels,
                                                              nullptr,
                                                              &RoleMembers::startups,
                                                              &RoleMembers::behaviors,
                                                              &RoleMembers::commands,
                                                              &RoleMembers::handlers,
                                                              &RoleMembers::methods};
  return &(role->*kTables[static_cast<int>(kind)]);
}

// The words of the language, but for requirements, which the word `require` does not name.
std::string NameOf(MemberKind kind) {
  constexpr const char* kNames[] = {"field",    "label",   "requirement", "startup",
                                    "behavior", "command", "handler",     "function"};
  return kNames[static_cast<int>(kind)];
}

bool CoversAll(const Stmt& statement) {
  size_t values = 0;
  for (const SwitchCase& one : statement.cases) {
    if (one.is_default()) return true;
    values += one.values.size();
  }
  // No value has two cases.
  return statement.type == Type::kBool && values == 2;
}

ExprPtr CopyOf(const Expr& expr) {
  auto copy = std::make_unique<Expr>();
  copy->kind = expr.kind;
  copy->op = expr.op;
  copy->depth = expr.depth;
  copy->span = expr.span;
  copy->name_span = expr.name_span;
  copy->name = expr.name;
  copy->integer = expr.integer;
  copy->number = expr.number;
  for (const ExprPtr& operand : expr.operands) copy->operands.push_back(CopyOf(*operand));
  return copy;
}

bool IsWholeNumber(const Expr& expr) {
  return expr.meaning == Meaning::kBuiltin &&
         (expr.opcode == vm::Opcode::kFloor || expr.opcode == vm::Opcode::kRound);
}

std::string NameOf(Operator op) {
  constexpr const char* kNames[] = {
      "", "+", "-", "*", "/", "%", "==", "!=", "<", "<=", ">", ">=", "&&", "||", "!", "-"};
  return kNames[static_cast<int>(op)];
}

}  // namespace morphbus::dynarole
