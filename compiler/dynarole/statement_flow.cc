#include "compiler/dynarole/statement_flow.h"

#include <algorithm>

#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

namespace {

// True if the expression is a loop's condition that never fails.
bool IsAlwaysTrue(const Expr& condition) {
  // What rests on a field or variable may change while the program runs, and is not folded.
  const FoldResult folded = Fold(condition);
  return folded.value && folded.value->type == Type::kBool && folded.value->cell.AsBool();
}

// A `break` leaves the innermost loop or switch around it only.
bool Breaks(const Stmt& statement) {
  if (statement.kind == StmtKind::kBreak) return true;
  if (statement.kind == StmtKind::kWhile || statement.kind == StmtKind::kFor ||
      statement.kind == StmtKind::kForEach || statement.kind == StmtKind::kSwitch) {
    return false;
  }
  return std::any_of(statement.body.begin(), statement.body.end(),
                     [](const StmtPtr& inner) { return Breaks(*inner); });
}

}  // namespace

bool AlwaysReturns(const Stmt& statement) {
  switch (statement.kind) {
    case StmtKind::kReturn:
    case StmtKind::kBreak:
    case StmtKind::kContinue:
      return true;
    case StmtKind::kBlock:
      // One statement that never ends normally is enough.
      for (const StmtPtr& inner : statement.body) {
        if (AlwaysReturns(*inner)) return true;
      }
      return false;
    case StmtKind::kIf:
      // Without an else there is a way past the branch.
      return statement.body.size() == 2 && AlwaysReturns(*statement.body[0]) &&
             AlwaysReturns(*statement.body[1]);
    case StmtKind::kSwitch:
      // Every value must lead to a block that ends so, and none may leave the switch alone.
      return CoversAll(statement) && std::ranges::all_of(statement.body, [](const StmtPtr& block) {
               return AlwaysReturns(*block) && !Breaks(*block);
             });
    case StmtKind::kWhile:
      // Only a return leaves a loop without end that nothing breaks.
      return statement.expr != nullptr && IsAlwaysTrue(*statement.expr) &&
             !Breaks(*statement.body[0]);
    case StmtKind::kFor:
      return (statement.expr == nullptr || IsAlwaysTrue(*statement.expr)) &&
             !Breaks(*statement.body[2]);
    default:
      return false;
  }
}

}  // namespace morphbus::dynarole
