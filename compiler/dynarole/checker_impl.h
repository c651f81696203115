#pragma once
// The checker's state, shared by checker.cc (passes, fields, whole program), checker_stmt.cc,
// checker_expr.cc and checker_call.cc.

#include <set>
#include <string>
#include <vector>

#include "compiler/dynarole/builtins.h"
#include "compiler/dynarole/checker.h"

namespace morphbus::dynarole {

class Checker {
 public:
  Checker(const source::SourceSet& sources, const KeywordTable& keywords, ProgramModel* model,
          source::Diagnostics* diagnostics)
      : sources_(sources), keywords_(keywords), model_(*model), diagnostics_(*diagnostics) {}

  void Run();

 private:
  /// What is still allowed to settle types in a pass.
  enum class Phase : uint8_t { kBodies, kCalls, kDefaults, kFinal };

  struct Local {
    std::string name;
    source::Span span;
    int slot = 0;
    bool used = false;
    bool parameter = false;
  };

  // Messages; nowhere but in the final pass.
  source::Diagnostic& Error(const source::Span& span, std::string message);
  source::Diagnostic& Warning(const source::Span& span, std::string message);
  void Suggest(source::Diagnostic* error, const std::string& name,
               const std::vector<std::string>& candidates, const std::string& prefix = "",
               const std::string& otherwise = "");
  bool Settle(Type* slot, Type type);

  // The whole program (checker.cc).
  void Pass();
  void CheckFieldValues(int role);
  void CheckRoutine(int index);
  void CheckFieldsSet(int role);
  void CheckSignatures();
  void CheckCalls();
  bool VisitCalls(int routine, std::vector<int>* path);
  [[nodiscard]] std::set<int> CalleesOf(const Routine& routine) const;
  void CheckPurity(const Routine& routine);

  // Statements (checker_stmt.cc).
  void CheckStatement(Stmt* statement);
  void CheckBlock(Stmt* block);
  void CheckScoped(Stmt* statement);
  void CheckVar(Stmt* statement);
  void CheckAssign(Stmt* statement);
  void CheckReturn(Stmt* statement);
  void CheckExprStatement(Stmt* statement);
  void CheckCondition(Expr* condition, const char* word);
  [[nodiscard]] bool AlwaysReturns(const Stmt& statement) const;
  void CloseScope(size_t size);
  int AddLocal(const std::string& name, const source::Span& span, Type type, bool parameter);
  [[nodiscard]] Local* FindLocal(const std::string& name);

  // Expressions (checker_expr.cc).
  Type Infer(Expr* expr);
  Type InferUnconverted(Expr* expr);
  void Want(Expr* expr, Type wanted, const std::string& what);
  void Hint(Expr* expr, Type type);
  Type InferName(Expr* expr);
  Type InferDollar(Expr* expr);
  Type InferMember(Expr* expr);
  Type InferUnary(Expr* expr);
  Type InferBinary(Expr* expr);
  Type InferArithmetic(Expr* expr);
  Type InferComparison(Expr* expr);
  void CompareSizes(Expr* set, Expr* other);
  Type UnknownName(Expr* expr);
  Type UseKeyword(Expr* expr, int keyword);

  // Calls (checker_call.cc).
  Type InferCall(Expr* expr);
  Type InferSizeof(Expr* call);
  Type InferSelf(Expr* member, Expr* call);
  Type InferSelfKeyword(Expr* member, Expr* call);
  Type InferPart(Expr* member, Expr* call);
  Type InferConnectorState(Expr* member, Expr* call);
  Type InferInvoke(Expr* member, Expr* call, int role);
  Type InferMethod(Expr* call, const std::string& name, const source::Span& span, int slot);
  Type ApplyBuiltin(const std::vector<Builtin>& table, const std::string& prefix, Expr* member,
                    Expr* call);
  void CheckCount(const Builtin& builtin, const Expr& count);
  void CheckArguments(Expr* call, int signature, const std::string& what);
  void Uses(vm::Opcode opcode, const source::Span& span, const std::string& name);

  [[nodiscard]] RoleModel& Owner() { return model_.roles[static_cast<size_t>(routine_->role)]; }
  [[nodiscard]] bool InTask() const {
    return routine_ != nullptr && routine_->kind != MemberKind::kRequire &&
           routine_->kind != MemberKind::kLabel;
  }

  const source::SourceSet& sources_;
  const KeywordTable& keywords_;
  ProgramModel& model_;
  source::Diagnostics& diagnostics_;
  source::Diagnostic muted_;
  Phase phase_ = Phase::kBodies;
  bool changed_ = false;
  int errors_ = 0, warnings_ = 0;
  std::vector<int> heights_;  ///< Of each routine: frames it needs with all it calls, 0 unknown.

  // Of the routine or field value being checked.
  Routine* routine_ = nullptr;  ///< Null in a field's value.
  int role_ = -1;
  std::vector<Local> locals_;
};

}  // namespace morphbus::dynarole
