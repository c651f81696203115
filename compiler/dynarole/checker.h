#pragma once
// Types and meanings. Parameters, abstract fields and results have no written types; they are found
// by checking everything again, silently, until nothing changes, and then once aloud.

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/program_model.h"
#include "compiler/keywords/keyword_table.h"
#include "compiler/source/diagnostics.h"

namespace morphbus::dynarole {

/// Finds the types and meanings of all expressions and statements and writes them into the tree and
/// the model, until a pass over the program finds nothing new. What does not fit is an error in
/// `diagnostics`; a program without errors can be translated by Generate.
/// @param keywords  the words for parts of the module types that the program is compiled for.
/// @param model     what BuildModel made; gets types, effects, locals, calls and keywords used.
void Check(const source::SourceSet& sources, const keywords::KeywordTable& keywords,
           ProgramModel* model, source::Diagnostics* diagnostics);

/// Warnings about a program without errors: what is never used, can never be reached, or never
/// holds (lints.cc).
void Lint(const keywords::KeywordTable& keywords, const ProgramModel& model,
          source::Diagnostics* diagnostics);

// The checker's state, shared by checker.cc (passes, fields, whole program), checker_statement.cc,
// checker_expression.cc and checker_call.cc.

/// Checks a whole program. Types of parameters, results and fields may follow from code anywhere in
/// it, so it goes over the program again until nothing new is found, and reports in a last pass.
class Checker {
 public:
  /// All arguments must outlive the checker.
  Checker(const source::SourceSet& sources, const keywords::KeywordTable& keywords,
          ProgramModel* model, source::Diagnostics* diagnostics)
      : sources_(sources), keywords_(keywords), model_(*model), diagnostics_(*diagnostics) {}

  /// Checks the program, and writes types and meanings into the model and its tree. Errors and
  /// warnings go to the diagnostics.
  void Run();

 private:
  /// What may settle types in a pass, the most telling first: what bodies need, what calls give,
  /// what a number beside a parameter suggests. In the last nothing does, and messages are
  /// recorded.
  enum class Phase : uint8_t { kBodies, kCalls, kDefaults, kFinal };

  /// What a joint can do in at least one module type.
  struct Motions {
    bool turns = false, slides = false;
  };

  /// A variable or parameter that can be used at the statement being checked.
  struct Local {
    std::string name;
    source::Span span;  ///< Where it was declared.
    int slot = 0;       ///< In Routine::locals.
    /// Some expression reads it; one that nothing reads gets a warning.
    bool used = false;
    bool parameter = false;  ///< Parameters need not be used.
  };

  // Messages are recorded in the final pass only; before it the caller gets one that is dropped.
  // The reference is good until the next message, for adding a hint or a note.
  source::Diagnostic& Error(const source::Span& span, std::string message);
  source::Diagnostic& Warning(const source::Span& span, std::string message);
  /// An error in an expression, whose type is then this: kError.
  Type Wrong(const source::Span& span, std::string message, std::string hint = "");
  /// Gives the error a hint: the candidate nearest to `name`, behind `prefix`, or `otherwise`.
  void Suggest(source::Diagnostic* error, const std::string& name,
               const std::vector<std::string>& candidates, const std::string& prefix = "",
               const std::string& otherwise = "");
  /// Gives a parameter a type if it has none yet; says whether it did.
  bool Settle(Type* slot, Type type);
  /// Gives another type, if it is another.
  void Change(Type* slot, Type type);

  // Constants (checker_constant.cc).
  /// Computes all of them, before any other expression is looked at.
  void CheckConstants();
  /// Computes one, after those that it rests on; its type is kError if that fails.
  void ResolveConstant(int index);
  /// The type and value of a constant where it is named.
  Type InferConstant(Expr* expr, int index);

  // The whole program (checker.cc).
  /// One walk over all fields and routines.
  void Pass();
  void CheckFieldValues(int role);
  /// Computes the period of a timer.
  void CheckPeriod(Member* member);
  /// Checks the body or expression of the routine of this index.
  void CheckRoutine(int index);
  /// Reports the fields that a concrete role leaves without a value.
  void CheckFieldsSet(int role);
  /// Reports parameters and fields whose types nothing tells, and what commands cannot take.
  void CheckSignatures();
  /// Reports circles of calls, calls that nest too deep for the VM's stack of frames, and functions
  /// that act where they may not.
  void CheckCalls();
  /// Follows calls in depth; `path` are the routines from the first caller to this one. False, with
  /// an error, where they form a circle or nest too deep.
  bool VisitCalls(int routine, std::vector<int>* path);
  /// Reports functions that act and are called by a requirement or label.
  void CheckPurity(const Routine& routine);

  // Statements (checker_statement.cc).
  void CheckStatement(Stmt* statement);
  void CheckBlock(Stmt* block);
  /// The same with a scope of its own, as branches and bodies have also without braces.
  void CheckScoped(Stmt* statement);
  /// `var NAME = VALUE;` declares a local, whose type is that of the value.
  void CheckVar(Stmt* statement);
  void CheckAssign(Stmt* statement);
  /// A return settles the type of the routine's result, or must fit it.
  void CheckReturn(Stmt* statement);
  void CheckExprStatement(Stmt* statement);
  /// A loop with a head of its own, whose variable ends with it.
  void CheckFor(Stmt* statement);
  /// `break` and `continue` stand in a loop.
  void CheckLeave(const Stmt& statement);
  /// `word` is that of the statement, "if" or "while", for the message.
  void CheckCondition(Expr* condition, const char* word);
  /// Whether what stands behind the statement is never reached, in its block.
  [[nodiscard]] bool AlwaysReturns(const Stmt& statement) const;
  /// Forgets the locals from number `size` on, with a warning for those that were never used.
  void CloseScope(size_t size);
  /// Declares a variable or parameter and returns its slot.
  int AddLocal(const std::string& name, const source::Span& span, Type type, bool parameter);
  /// The local of that name in scope; null if there is none.
  [[nodiscard]] Local* FindLocal(const std::string& name);

  // Expressions (checker_expression.cc). Those called Infer... find an expression's type and
  // meaning, set them in the tree, and return the type.
  Type Infer(Expr* expr);
  Type InferUnconverted(Expr* expr);
  /// Records that the expression is to be converted to a type, or reports why it cannot be; `what`
  /// begins the message: "argument 2 of 'self.joints'".
  void Want(Expr* expr, Type wanted, const std::string& what);
  /// Tells a parameter of unknown type, alone or in a sum, that its surroundings want this one.
  void Hint(Expr* expr, Type type);
  Type InferName(Expr* expr);
  Type InferDollar(Expr* expr);
  Type InferMember(Expr* expr);
  Type InferUnary(Expr* expr);
  Type InferBinary(Expr* expr);
  Type InferArithmetic(Expr* expr);
  Type InferDiagonal(Expr* expr);
  Type InferComparison(Expr* expr);
  /// Makes `set` stand for its size beside the number `other`.
  void CompareSizes(Expr* set, Expr* other);
  /// Reports a name that means nothing here, with the nearest one; returns kError.
  Type UnknownName(Expr* expr);
  /// Names of variables and fields that may stand here, for suggestions.
  [[nodiscard]] std::vector<std::string> NamesInScope() const;
  /// `self.SENSOR.GET_DISTANCE()`, where `keyword` is the sensor's.
  Type InferSensor(Expr* member, Expr* call, int keyword);
  /// For self.distance, contact and tilt: the keyword of the kind of sensor that they need.
  Type UseSensorKind(Expr* expr, const source::Span& span);
  /// Makes the expression mean the keyword of that index in the table.
  Type UseKeyword(Expr* expr, int keyword);

  // Calls (checker_call.cc). `call` is null where a member stands without parentheses.
  Type InferCall(Expr* expr);
  /// Reports a command of the own role that is called as if it were a function.
  Type CommandAsFunction(const std::string& name, const source::Span& span);
  /// sizeof(SET) is the number of its members.
  Type InferSizeof(Expr* call);
  Type InferSelf(Expr* member, Expr* call);
  Type InferSelfKeyword(Expr* member, Expr* call);
  Type InferPart(Expr* member, Expr* call);
  Type InferConnectorState(Expr* member, Expr* call);
  /// A command of another role, or of the own one, by its name: Role.command(...).
  Type InferInvoke(Expr* member, Expr* call, int role, Meaning meaning = Meaning::kInvoke);
  /// A call of a function of the role, which has this method slot.
  Type InferMethod(Expr* call, const std::string& name, const source::Span& span, int slot);
  /// Finds the form of a builtin that has as many arguments, and checks them.
  Type ApplyBuiltin(const std::vector<Builtin>& table, const std::string& prefix, Expr* member,
                    Expr* call);
  // What is neither of self nor of a role or part (checker_function.cc).
  /// A function of the language, such as sin(x); kUnknown without a message if there is none of the
  /// name.
  std::optional<Type> InferFunction(Expr* call);
  /// `print("text", value, ...)`
  Type InferPrint(Expr* call);
  /// What stands behind the dot of a set of neighbours: a shared field or a command of their role.
  Type InferNeighbours(Expr* member, Expr* call);
  /// `super.NAME(args)`: the routine that this one replaces.
  Type InferSuper(Expr* member, Expr* call);

  /// Reports a joint that the call can move in no module type.
  void CheckMotion(const Builtin& builtin, const Expr& joint);
  [[nodiscard]] Motions MotionsOf(const Expr& joint) const;
  /// Reports a number of joints that no body can have.
  void CheckCount(const Builtin& builtin, const Expr& count);
  /// The arguments of a call must fit the signature; they may also settle types of parameters.
  void CheckArguments(Expr* call, int signature, const std::string& what);
  /// Notes what an instruction does to the module; an error in requirements and labels if it acts.
  void Uses(vm::Opcode opcode, const source::Span& span, const std::string& name);

  /// The role whose names the expression being checked sees; one without any outside all roles.
  [[nodiscard]] const RoleModel& Scope() const {
    return role_ < 0 ? no_role_ : model_.roles[role_];
  }
  /// The role that declares the routine being checked.
  [[nodiscard]] RoleModel& Owner() { return model_.roles[routine_->role]; }
  /// Whether the code being checked runs as part of a task, where it may act.
  [[nodiscard]] bool InTask() const {
    return routine_ != nullptr && routine_->kind != MemberKind::kRequire &&
           routine_->kind != MemberKind::kLabel;
  }

  const source::SourceSet& sources_;
  const keywords::KeywordTable& keywords_;
  ProgramModel& model_;
  source::Diagnostics& diagnostics_;
  source::Diagnostic muted_;  ///< What Error() and Warning() hand out where nothing is recorded.
  Phase phase_ = Phase::kBodies;
  /// A type was settled in this pass, so that another must follow.
  bool changed_ = false;
  int errors_ = 0, warnings_ = 0;  ///< Recorded so far.
  bool listed_self_ = false;       ///< A hint has listed all that `self` has.
  /// By routine: the frames that it needs with all that it calls; 0 where that is not known yet.
  std::vector<int> heights_;

  // The routine or field value being checked.
  Routine* routine_ = nullptr;  ///< Null in a field's value.
  int role_ = -1;               ///< The role that declares it; -1 outside all roles.
  RoleModel no_role_;           ///< Without members.
  int constant_depth_ = 0;      ///< Constants that are being computed, each for the one before.
  int loops_ = 0;               ///< Loops around the statement being checked.
  std::vector<Local> locals_;   ///< In scope, from the first declared.
};

}  // namespace morphbus::dynarole
