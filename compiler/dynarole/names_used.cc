#include "compiler/dynarole/names_used.h"

#include <map>
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

/// Names that were found, each once, in the order in which they were.
struct FoundNames {
  std::set<std::string> seen;
  std::vector<std::string> all;
};

/// Adds all names in an expression, statement or member, whatever they stand for.
void AddNames(const Expr* expr, FoundNames* names) {
  if (expr == nullptr) return;
  const bool named = expr->kind == ExprKind::kName || expr->kind == ExprKind::kMember;
  if (named && names->seen.insert(expr->name).second) names->all.push_back(expr->name);
  for (const ExprPtr& operand : expr->operands) AddNames(operand.get(), names);
}

void AddNames(const Stmt* statement, FoundNames* names) {
  if (statement == nullptr) return;
  AddNames(statement->expr.get(), names);
  AddNames(statement->subscript.get(), names);
  for (const SwitchCase& one : statement->cases) {
    for (const ExprPtr& value : one.values) AddNames(value.get(), names);
  }
  for (const StmtPtr& inner : statement->body) AddNames(inner.get(), names);
}

void AddNames(const Member& member, FoundNames* names) {
  AddNames(member.expr.get(), names);
  AddNames(member.period.get(), names);
  AddNames(member.body.get(), names);
}

}  // namespace

void LeaveOutUnused(Program* program) {
  if (program->root == nullptr) return;
  std::vector<Member>& functions = program->root->members;
  FoundNames names;
  for (const Role& role : program->roles) {
    for (const Member& member : role.members) AddNames(member, &names);
  }
  // Functions of the program's own file are wanted whether or not they are called.
  std::vector<bool> wanted(functions.size());
  std::multimap<std::string, size_t> by_name;
  for (size_t i = 0; i < functions.size(); ++i) {
    wanted[i] = functions[i].name_span.file == 0;
    if (wanted[i]) AddNames(functions[i], &names);
    by_name.emplace(functions[i].name, i);
  }
  // Of the others each that is named may name more.
  for (size_t n = 0; n < names.all.size(); ++n) {
    const auto [begin, end] = by_name.equal_range(names.all[n]);
    for (auto at = begin; at != end; ++at) {
      if (wanted[at->second]) continue;
      wanted[at->second] = true;
      AddNames(functions[at->second], &names);
    }
  }
  std::vector<Member> kept;
  for (size_t i = 0; i < functions.size(); ++i) {
    (wanted[i] ? kept : program->left_out).push_back(std::move(functions[i]));
  }
  functions = std::move(kept);
  if (functions.empty()) program->root = nullptr;
}

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
