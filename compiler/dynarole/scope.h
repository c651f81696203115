#pragma once
// Where the expression stands that is being checked, and which names it sees there.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "compiler/dynarole/check_pass.h"
#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {

/// A variable or parameter that can be used at the statement being checked.
struct Local {
  std::string name;
  source::Span span;  ///< Where it was declared.
  int slot = 0;       ///< In Routine::locals; of an array that of its first element.
  int length = 0;     ///< How many elements an array has; 0: it is none.
  /// Some expression reads it; one that nothing reads gets a warning.
  bool used = false;
  bool parameter = false;  ///< Parameters need not be used.
  /// It is a neighbour, the one of a loop's round, which nothing assigns to.
  bool neighbour = false;
  int role = -1;            ///< Of a neighbour: the role that it plays; -1: not known.
  bool field_read = false;  ///< Of a neighbour: a shared field of it is read.
};

/// The routine or value being checked, with the variables that can be used there.
class Scope {
 public:
  /// Both must outlive it.
  Scope(ProgramModel* model, CheckPass* pass) : model_(*model), pass_(*pass) {}

  /// Goes on in the routine of this index, of which nothing is known yet: its variables and effect
  /// are found anew.
  void EnterRoutine(int index);
  /// Goes on in the value of a field or constant of this role; -1: outside all roles.
  void EnterValue(int role);

  /// The routine being checked; null in a value.
  [[nodiscard]] Routine* routine() const { return routine_; }
  /// What it shares with those that override it. It must have a body.
  [[nodiscard]] Signature& signature() const { return model_.signatures[routine_->signature]; }
  /// The index of the role that declares what is being checked; -1 outside all roles.
  [[nodiscard]] int role_index() const { return role_; }
  /// The role whose names the expression being checked sees; one without any outside all roles.
  [[nodiscard]] const RoleModel& role() const { return role_ < 0 ? no_role_ : model_.roles[role_]; }
  /// Whether the code being checked runs as part of a task, where it may act.
  [[nodiscard]] bool InTask() const;
  /// Notes what an instruction does to the module; an error in requirements and labels if it acts.
  void Uses(vm::Opcode opcode, const source::Span& span, const std::string& name);

  /// Declares a variable or parameter of the routine and returns its slot.
  int AddLocal(const std::string& name, const source::Span& span, Type type, bool parameter);
  /// Declares a variable that is an array and returns the slot of its first element.
  int AddArray(const std::string& name, const source::Span& span, Type type, int length);
  /// Declares one that no name means, which the code itself needs; `purpose` is for people.
  /// What is read before anything else of this `use` can be stored there shares one of its type.
  int Hidden(const std::string& purpose, const source::Span& span, Type type, int use = 0);
  /// The local of that name in scope; null if there is none, as in a value.
  [[nodiscard]] Local* FindLocal(const std::string& name);
  /// Whether an expression is the variable of a loop over neighbours.
  [[nodiscard]] bool IsNeighbour(const Expr& expr);
  /// How many locals are in scope, for Close.
  [[nodiscard]] size_t num_locals() const { return locals_.size(); }
  /// Forgets the locals from number `size` on, with a warning for those that were never used.
  void Close(size_t size);
  /// Names of variables, fields and constants that may stand here, for suggestions.
  [[nodiscard]] std::vector<std::string> Names() const;

 private:
  int Declare(const std::string& name, const source::Span& span, Type type, bool parameter,
              int length);
  int AddSlot(const std::string& name, const source::Span& span, Type type);

  ProgramModel& model_;
  CheckPass& pass_;
  Routine* routine_ = nullptr;
  int role_ = -1;
  RoleModel no_role_;          ///< Without members.
  std::vector<Local> locals_;  ///< In scope, from the first declared.
  /// Slots without a name, by their types and uses.
  std::map<std::pair<Type, int>, int> hidden_;
};

}  // namespace morphbus::dynarole
