#include "compiler/dynarole/program_checks.h"

#include <algorithm>
#include <string>
#include <vector>

namespace morphbus::dynarole {

namespace {

/// Whether the role or one above it gives a field of this name a value. One that its slot lacks
/// was refused, which has been said.
bool GivesValue(const ProgramModel& model, const RoleModel* role, const std::string& name) {
  const auto gives = [&](const Member& member) {
    return member.declared_name() == name && member.expr != nullptr;
  };
  while (std::ranges::none_of(role->role->members, gives)) {
    if (role->parent < 0) return false;
    role = &model.roles[role->parent];
  }
  return true;
}

/// How a role gives the field a value: "gains = [0.0, 0.0];".
std::string ExampleOf(const FieldDecl& decl) {
  if (decl.length == 0) return decl.name + " = ...;";
  // What is long is written shorter.
  const std::string length = std::to_string(decl.length);
  if (decl.length > 4) return decl.array + "[" + length + "] = 0.0;";
  std::string values = "0.0";
  for (int i = 1; i < decl.length; ++i) values += ", 0.0";
  return decl.array + " = [" + values + "];";
}

}  // namespace

void CheckFieldsSet(const ProgramModel& model, CheckPass* pass) {
  // Of each field: some role sets it, or what is wrong with it has been said.
  std::vector<bool> settled(model.fields.size());
  for (const RoleModel& role : model.roles) {
    for (const FieldSlot& slot : role.fields) {
      const FieldDecl& decl = model.fields[slot.decl];
      const bool given = slot.value != nullptr || GivesValue(model, &role, decl.declared_name());
      // Only concrete roles are played, so abstract ones may leave fields open.
      const bool open = !given && (role.role->abstract_role || role.broken);
      if (!open) settled[slot.decl] = true;
      // All elements of an array have values or none has.
      if (given || open || decl.element > 0) continue;
      pass->Error(role.role->name_span,
                  "role '" + role.name + "' does not set the field '" + decl.declared_name() + "'")
          .Hint("give it a value: " + ExampleOf(decl) + " or make the role abstract")
          .Note(decl.span, "declared without a value here");
    }
  }
  // A field that no role sets has no type to find.
  for (size_t i = 0; i < model.fields.size(); ++i) {
    const FieldDecl& decl = model.fields[i];
    if (decl.type != Type::kUnknown || settled[i] || decl.element > 0) continue;
    pass->Error(decl.span,
                "no role sets the field '" + decl.declared_name() + "', so it has no type")
        .hint = "give it a value here or in a subrole";
  }
}

void CheckSignatures(const ProgramModel& model, CheckPass* pass) {
  // One complaint a parameter, where it was first declared.
  for (const Routine& routine : model.routines) {
    if (routine.signature < 0) continue;
    const Signature& signature = model.signatures[routine.signature];
    // Routines that override each other share a signature; the first of them speaks for all.
    const source::Span& name = routine.member->name_span;
    if (name.file != signature.span.file || name.begin != signature.span.begin) continue;
    for (size_t i = 0; i < signature.parameters.size(); ++i) {
      const Type type = signature.parameters[i];
      const Parameter& parameter = routine.member->parameters[i];
      if (type == Type::kUnknown) {
        pass->Error(parameter.span,
                    "cannot tell the type of the parameter '" + parameter.name + "'")
            .hint = "write it before the name, for example: float " + parameter.name;
      } else if (routine.kind == MemberKind::kCommand && ValueTypeOf(type) > vm::ValueType::kRole) {
        pass->Error(parameter.span, "parameter '" + parameter.name + "' is " + NameOf(type) +
                                        ", which means nothing to another module")
            .hint = "commands take bools, ints, floats, directions, axes and roles";
      }
    }
  }
}

namespace {

/// Finds out how many frames each routine needs, and what it may do.
class CallGraph {
 public:
  CallGraph(ProgramModel* model, CheckPass* pass)
      : model_(*model), pass_(*pass), heights_(model->routines.size()) {}

  /// Follows the calls of a routine in depth, every routine once. False, with an error, where they
  /// form a circle or nest too deep.
  bool Visit(int index) {
    Routine& routine = model_.routines[index];
    int& height = heights_[index];
    // The routine stands on the path if it calls itself over others.
    const bool circle = std::find(path_.begin(), path_.end(), index) != path_.end();
    const int frames = static_cast<int>(path_.size()) + std::max(height, 1);
    if (circle || frames > vm::kMaxCallDepth) {
      // The hint shows the whole chain, as the call that closes it may stand far away.
      std::string chain;
      for (const int step : path_) chain += model_.routines[step].name + " -> ";
      pass_
          .Error(routine.member->name_span,
                 circle ? "function '" + routine.member->name + "' calls itself"
                        : "calls nest too deep")
          .hint = chain + routine.name +
                  (circle ? "; use 'while' instead"
                          : "; at most " + std::to_string(vm::kMaxCallDepth) + " deep");
      return false;
    }
    // What is known of a routine holds whoever calls it.
    if (height > 0) return true;
    // What a routine may do and how many frames it needs follows from all that it may call.
    path_.push_back(index);
    int highest = 0;
    for (const int callee : model_.CalleesOf(routine)) {
      if (!Visit(callee)) return false;
      highest = std::max(highest, heights_[callee]);
      routine.effect = std::max(routine.effect, model_.routines[callee].effect);
    }
    path_.pop_back();
    height = highest + 1;
    return true;
  }

 private:
  ProgramModel& model_;
  CheckPass& pass_;
  /// By routine: the frames that it needs with all that it calls; 0 where that is not known yet.
  std::vector<int> heights_;
  std::vector<int> path_;  ///< From the first caller to the routine that is visited.
};

/// Reports functions that act and are called by a requirement or label.
void CheckPurity(const ProgramModel& model, const Routine& routine, CheckPass* pass) {
  // What the routine itself does was checked where it stands; this is about what it calls.
  if (routine.kind != MemberKind::kRequire && routine.kind != MemberKind::kLabel) return;
  for (const CallSite& call : routine.calls) {
    const int callee =
        call.routine >= 0 ? call.routine : model.roles[routine.role].methods[call.slot].routine;
    const Routine& called = model.routines[callee];
    if (called.effect == vm::Effect::kPure) continue;
    pass->Error(call.span, "function '" + called.member->name + "' acts on the module, which a " +
                               NameOf(routine.kind) + " must not")
        .Hint("requirements and labels only ask about the robot's structure")
        .Note(called.member->name_span, "declared here");
  }
}

}  // namespace

void CheckCalls(ProgramModel* model, CheckPass* pass) {
  CallGraph calls(model, pass);
  for (int i = 0; i < std::ssize(model->routines); ++i) {
    if (!calls.Visit(i)) return;
  }
  for (const Routine& routine : model->routines) CheckPurity(*model, routine, pass);
}

}  // namespace morphbus::dynarole
