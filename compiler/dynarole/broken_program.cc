#include "compiler/dynarole/broken_program.h"

#include <utility>

#include "compiler/dynarole/checker.h"
#include "compiler/dynarole/name_index.h"
#include "compiler/dynarole/program_model.h"

namespace morphbus::dynarole {
namespace {

/// An expression that the checker is silent about, where one is missing.
void FillExpr(const source::Span& span, ExprPtr* expr) {
  if (*expr != nullptr) return;
  *expr = std::make_unique<Expr>();
  (*expr)->span = (*expr)->name_span = span;
}

/// Gives a statement the parts that the checker counts on.
void FillStatement(Stmt* statement) {
  const StmtKind kind = statement->kind;
  const bool branches =
      kind == StmtKind::kIf || kind == StmtKind::kWhile || kind == StmtKind::kForEach;
  if (branches || kind == StmtKind::kSwitch || kind == StmtKind::kVar ||
      kind == StmtKind::kAssign || kind == StmtKind::kExpr) {
    FillExpr(statement->span, &statement->expr);
  }
  if (branches && statement->body.empty()) {
    statement->body.push_back(std::make_unique<Stmt>());
    statement->body.back()->span = statement->span;
  }
  for (StmtPtr& inner : statement->body) FillStatement(inner.get());
}

void FillRole(Role* role) {
  for (Member& member : role->members) {
    const bool valued = member.kind == MemberKind::kLabel || member.kind == MemberKind::kRequire;
    if (valued) FillExpr(member.name_span, &member.expr);
    if (member.body != nullptr) FillStatement(member.body.get());
  }
}

}  // namespace

source::NameTable NamesOfBroken(const source::SourceSet& sources,
                                const keywords::KeywordTable& keywords, Program* program) {
  for (Role& role : program->roles) FillRole(&role);
  if (program->root != nullptr) FillRole(program->root.get());
  source::Diagnostics unsaid;
  ProgramModel model = BuildModel(program, &unsaid);
  Check(keywords, &model, &unsaid);
  return IndexNames(sources, keywords, model);
}

}  // namespace morphbus::dynarole
