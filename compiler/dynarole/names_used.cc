#include "compiler/dynarole/names_used.h"

#include <set>

namespace morphbus::dynarole {
namespace {

// Walks over one member; recursion is bounded by the depth that the parser allows.
class Walk {
 public:
  /// The member's names, in the order of the text.
  std::vector<std::string> Run(const Member& member) {
    for (const Parameter& parameter : member.parameters) declared_.insert(parameter.name);
    if (member.expr != nullptr) Visit(*member.expr);
    if (member.body != nullptr) Visit(*member.body);
    // A variable is one in the whole member: a field of its name is hidden, or the slip is
    // reported.
    std::erase_if(used_, [this](const std::string& name) { return declared_.contains(name); });
    return std::move(used_);
  }

 private:
  void Visit(const Expr& expr) {
    if (expr.kind == ExprKind::kName) used_.push_back(expr.name);
    for (size_t i = 0; i < expr.operands.size(); ++i) {
      // What is called is a function, or a command behind the name of its role.
      const Expr& operand = *expr.operands[i];
      const bool callee = expr.kind == ExprKind::kCall && i == 0;
      if (callee && operand.kind == ExprKind::kName) continue;
      const bool of_role = callee && operand.kind == ExprKind::kMember &&
                           operand.operands[0]->kind == ExprKind::kName;
      if (!of_role) Visit(operand);
    }
  }

  void Visit(const Stmt& statement) {
    // A variable counts as one in the whole member, also before its statement.
    if (statement.kind == StmtKind::kVar || statement.kind == StmtKind::kForEach) {
      declared_.insert(statement.name);
    }
    if (statement.kind == StmtKind::kAssign) used_.push_back(statement.name);
    if (statement.expr != nullptr) Visit(*statement.expr);
    if (statement.subscript != nullptr) Visit(*statement.subscript);
    for (const SwitchCase& one : statement.cases) {
      for (const ExprPtr& value : one.values) Visit(*value);
    }
    for (const StmtPtr& inner : statement.body) Visit(*inner);
  }

  std::vector<std::string> used_;
  std::set<std::string> declared_;
};

}  // namespace

std::vector<std::string> NamesUsedIn(const Role& role) {
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (const Member& member : role.members) {
    for (std::string& name : Walk().Run(member)) {
      if (seen.insert(name).second) names.push_back(std::move(name));
    }
  }
  return names;
}

}  // namespace morphbus::dynarole
