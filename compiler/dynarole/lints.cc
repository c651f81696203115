#include "compiler/dynarole/lints.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "compiler/dynarole/constants.h"

namespace morphbus::dynarole {

namespace {

using source::Diagnostic;
using source::Span;

/// What a requirement demands of one expression: `text == value`.
struct Demand {
  std::string text;
  uint32_t value = 0;
  Span span;
};

// Warns of what is allowed but hardly meant. It reads a program that has been checked and changes
// nothing.
class Linter {
 public:
  Linter(const keywords::KeywordTable& keywords, const ProgramModel& model,
         source::Diagnostics* diagnostics)
      : keywords_(keywords), model_(model), diagnostics_(*diagnostics) {}

  void Run() {
    LintUnused();
    LintDivisions();
    for (size_t i = 0; i < model_.roles.size(); ++i) {
      // What could keep a role from being taken matters for concrete roles only.
      const RoleModel& role = model_.roles[i];
      if (role.role->abstract_role) continue;
      LintRequirements(static_cast<int>(i));
      LintHidden(static_cast<int>(i));
      LintKeywords(static_cast<int>(i));
    }
    for (const Routine& routine : model_.routines) {
      if (routine.member->body != nullptr) LintLoops(*routine.member->body);
    }
    const bool any = std::any_of(model_.roles.begin(), model_.roles.end(),
                                 [](const RoleModel& r) { return !r.role->abstract_role; });
    if (!any && !model_.program->roles.empty()) {
      diagnostics_.Warning(model_.program->roles[0].name_span,
                           "all roles are abstract, so no module "
                           "can take any");
    }
  }

 private:
  void LintUnused() {
    // The checker has noted what is read and called. A file that others import is for all of them,
    // and none needs all of it.
    const auto imported = [](const Span& span) { return span.file != 0; };
    for (const FieldDecl& decl : model_.fields) {
      // Of an array it is said once.
      const std::string& name = decl.array.empty() ? decl.name : decl.array;
      if (decl.read || imported(decl.span) ||
          (!decl.array.empty() && decl.name != decl.array + "[0]"))
        continue;
      diagnostics_.Warning(decl.span, "field '" + name + "' is never read");
    }
    for (const ConstantModel& constant : model_.constants) {
      // That some values of an enumeration are not used yet is no slip.
      if (!constant.used && constant.enumeration < 0 && !imported(constant.span)) {
        diagnostics_.Warning(constant.span,
                             constant.Kind() + " '" + constant.name + "' is never used");
      }
    }
    for (const Signature& signature : model_.signatures) {
      if (signature.kind == MemberKind::kFunction && !signature.called &&
          !imported(signature.span)) {
        diagnostics_.Warning(signature.span, "function '" + signature.name + "' is never called");
      }
    }
  }

  // ---- Ints that divide where a fraction is meant ----

  void LintDivisions() {
    for (const ConstantModel& constant : model_.constants) VisitDivisions(*constant.expr, false);
    for (const RoleModel& role : model_.roles) {
      for (const FieldSlot& field : role.fields) {
        const Member* value = field.value;
        if (value != nullptr && value->expr != nullptr) VisitDivisions(*value->expr, false);
      }
    }
    for (const Routine& routine : model_.routines) {
      const Member& member = *routine.member;
      if (member.expr != nullptr) VisitDivisions(*member.expr, false);
      if (member.body != nullptr) VisitDivisions(*member.body);
    }
  }

  void VisitDivisions(const Stmt& statement) {
    if (statement.expr != nullptr) VisitDivisions(*statement.expr, false);
    if (statement.subscript != nullptr) VisitDivisions(*statement.subscript, false);
    for (const StmtPtr& inner : statement.body) VisitDivisions(*inner);
  }

  // `becomes_float`: what is made of the expression's value is converted to a float.
  void VisitDivisions(const Expr& expr, bool becomes_float) {
    becomes_float = becomes_float || expr.wanted == Type::kFloat;
    if (expr.kind == ExprKind::kBinary && expr.op == Operator::kDiv && expr.type == Type::kInt &&
        WarnOfDivision(expr, becomes_float)) {
      return;
    }
    // What arithmetic of ints is converted to, its operands are.
    const bool passes_on = expr.type == Type::kInt &&
                           (expr.kind == ExprKind::kUnary || expr.kind == ExprKind::kBinary ||
                            expr.kind == ExprKind::kChoice);
    for (const ExprPtr& operand : expr.operands) {
      const bool condition = expr.kind == ExprKind::kChoice && operand == expr.operands.front();
      VisitDivisions(*operand, becomes_float && passes_on && !condition);
    }
  }

  // Ints that are known and leave no remainder divide as they seem to.
  bool WarnOfDivision(const Expr& expr, bool becomes_float) {
    // Values that nobody knows yet are judged by what is made of the quotient.
    const FoldResult a = Fold(*expr.operands[0]);
    const FoldResult b = Fold(*expr.operands[1]);
    const bool known = a.value && b.value && a.value->type == Type::kInt &&
                       b.value->type == Type::kInt && b.value->cell.AsInt() != 0;
    // The smallest int by -1 overflows; whoever computes it says so.
    if (known && b.value->cell.AsInt() == -1) return false;
    const int n = known ? a.value->cell.AsInt() : 0;
    const int d = known ? b.value->cell.AsInt() : 1;
    if (known ? n % d == 0 : !becomes_float) return false;
    // The same place is part of a role and of those that extend it.
    if (!divisions_.insert({expr.span.file, static_cast<size_t>(expr.span.begin)}).second)
      return true;
    Diagnostic& warning = diagnostics_.Warning(
        expr.span, known ? "ints divide without remainder: " + std::to_string(n) + " / " +
                               std::to_string(d) + " is " + std::to_string(n / d)
                         : std::string("ints divide without remainder, and the result becomes a "
                                       "float"));
    warning.hint = known ? "for a fraction write " + std::to_string(n) + ".0 / " +
                               std::to_string(d) + ", for the int " + std::to_string(n / d)
                         : std::string(
                               "for a fraction multiply the dividend by 1.0; if the int is "
                               "meant, give it to a variable first");
    return true;
  }

  Diagnostic& NeverTaken(const RoleModel& role) {
    return diagnostics_.Warning(role.role->name_span,
                                "role '" + role.name + "' can never be taken by any module");
  }

  // ---- Requirements that cannot hold together ----

  void LintRequirements(int index) {
    // Before any task has run, fields have the values that the role gives them.
    const RoleModel& role = model_.roles[index];
    const FieldValues fields = [this, &role](int slot) -> std::optional<Constant> {
      const FieldSlot& field = role.fields[slot];
      if (field.value == nullptr || field.parameter >= 0) return std::nullopt;
      return Constant{model_.fields[field.decl].type, field.cell};
    };
    // One requirement may be false by itself, or two may demand different values of the same
    // expression.
    std::vector<Demand> demands;
    for (const int requirement : role.requirements) {
      const Expr& expr = *model_.routines[requirement].member->expr;
      if (const Expr* never = FindNeverTrue(expr, &fields)) {
        NeverTaken(role).Note(never->span, "this requirement never holds");
        return;
      }
      CollectDemands(expr, role, &fields, &demands);
    }
    // Expressions are the same if their texts are.
    for (size_t i = 0; i < demands.size(); ++i) {
      for (size_t k = 0; k < i; ++k) {
        if (demands[i].text != demands[k].text || demands[i].value == demands[k].value) continue;
        NeverTaken(role)
            .Note(demands[k].span, "this requirement")
            .Note(demands[i].span, "contradicts this one");
        return;
      }
    }
  }

  // A conjunct that is false whatever the robot looks like.
  const Expr* FindNeverTrue(const Expr& expr, const FieldValues* fields) {
    // Both sides of `&&` must hold.
    if (expr.kind == ExprKind::kBinary && expr.op == Operator::kAnd) {
      const Expr* left = FindNeverTrue(*expr.operands[0], fields);
      return left != nullptr ? left : FindNeverTrue(*expr.operands[1], fields);
    }
    const FoldResult folded = Fold(expr, fields);
    if (folded.value && !folded.value->cell.AsBool()) return &expr;
    // A set cannot have fewer members than none, or more than a module has connectors.
    if (expr.kind != ExprKind::kBinary || expr.op != Operator::kEqual) return nullptr;
    for (int side = 0; side < 2; ++side) {
      const FoldResult size = Fold(*expr.operands[side], fields);
      const Expr& other = *expr.operands[1 - side];
      const bool counts = other.meaning == Meaning::kCount || IsSet(other.type);
      if (!counts || !size.value || size.value->type != Type::kInt) continue;
      const int value = size.value->cell.AsInt();
      if (value < 0 || value > vm::kMaxConnectors) return &expr;
    }
    return nullptr;
  }

  void CollectDemands(const Expr& expr, const RoleModel& role, const FieldValues* fields,
                      std::vector<Demand>* demands) {
    // Only a comparison says what a value has to be.
    if (expr.kind != ExprKind::kBinary) return;
    // Both sides of `&&` demand what they demand; `||` demands nothing for certain.
    if (expr.op == Operator::kAnd) {
      for (const ExprPtr& operand : expr.operands) CollectDemands(*operand, role, fields, demands);
      return;
    }
    if (expr.op != Operator::kEqual) return;
    for (size_t side = 0; side < 2; ++side) {
      const FoldResult value = Fold(*expr.operands[side], fields);
      if (!value.value) continue;
      // `expression == constant`, in either order.
      std::string text;
      if (TextOf(*expr.operands[1 - side], fields, &text)) {
        demands->push_back({text, value.value->cell.bits, expr.span});
      }
      return;
    }
  }

  // A text that is equal for equal questions about the robot; false for what may vary otherwise.
  bool TextOf(const Expr& expr, const FieldValues* fields, std::string* text) {
    // Constants with their bits, sizes as their sets, parts by number, questions by name and
    // arguments.
    // Two requirements ask the same question if these texts are equal.
    const FoldResult folded = Fold(expr, fields);
    if (folded.value) {
      *text += "#" + std::to_string(folded.value->cell.bits);
      return true;
    }
    if (expr.kind == ExprKind::kCall && expr.meaning == Meaning::kCount) {
      return TextOf(*expr.operands[1], fields, text);
    }
    if (expr.meaning == Meaning::kKeyword) {
      *text += "keyword" + std::to_string(expr.index);
      return true;
    }
    if (expr.meaning != Meaning::kBuiltin) return false;
    const Expr& member = expr.kind == ExprKind::kCall ? *expr.operands[0] : expr;
    // Functions of the language stand behind no dot.
    const Expr* base = member.operands.empty() ? nullptr : member.operands[0].get();
    if (base != nullptr && base->kind != ExprKind::kSelf && !TextOf(*base, fields, text)) {
      return false;
    }
    *text += "." + member.name + "(";
    // self.connected means self.connected($ANY).
    if (expr.opcode == vm::Opcode::kConnected &&
        (expr.kind == ExprKind::kMember || expr.operands.size() == 1)) {
      *text += "#0,";
    }
    for (size_t i = 1; expr.kind == ExprKind::kCall && i < expr.operands.size(); ++i) {
      if (!TextOf(*expr.operands[i], fields, text)) return false;
      *text += ",";
    }
    *text += ")";
    return true;
  }

  // A concrete role is hidden by a concrete subrole that asks no more of a module.
  void LintHidden(int index) {
    const RoleModel& role = model_.roles[index];
    for (const RoleModel& other : model_.roles) {
      if (other.parent != index || other.role->abstract_role) continue;
      // A subrole that adds or replaces none of these holds wherever its base does.
      const bool asks_more = std::any_of(
          other.role->members.begin(), other.role->members.end(), [](const Member& member) {
            return member.kind == MemberKind::kRequire || member.kind == MemberKind::kLabel ||
                   member.kind == MemberKind::kFunction || member.kind == MemberKind::kField;
          });
      if (asks_more) continue;
      NeverTaken(role).Note(other.role->name_span,
                            "this subrole asks no more of a module, and the "
                            "most derived role wins");
      return;
    }
  }

  // ---- Keywords ----

  void LintKeywords(int index) {
    if (keywords_.empty()) return;
    const RoleModel& role = model_.roles[index];
    // A module takes the role only if its type has every keyword in all the role's code: the bits
    // left over are the types that do.
    uint64_t types = ~uint64_t{0};
    const auto visit = [&](int routine) {
      const Member& member = *model_.routines[routine].member;
      if (member.expr != nullptr) VisitKeywords(*member.expr, &types);
      if (member.body != nullptr) VisitKeywords(*member.body, &types);
    };
    for (const int requirement : role.requirements) visit(requirement);
    for (const auto* slots : {&role.labels, &role.startups, &role.behaviors, &role.commands,
                              &role.handlers, &role.methods}) {
      for (const NamedSlot& slot : *slots) visit(slot.routine);
    }
    if (types != 0) return;
    // Every type lacks some part, though each part may be there in another.
    NeverTaken(role).hint =
        "no module type given has all the links, joints and connectors that it names";
  }

  void VisitKeywords(const Expr& expr, uint64_t* types) {
    if (expr.meaning == Meaning::kKeyword) {
      *types &= keywords_.all()[model_.keywords[expr.index]].types;
    }
    for (const ExprPtr& operand : expr.operands) VisitKeywords(*operand, types);
  }

  void VisitKeywords(const Stmt& statement, uint64_t* types) {
    if (statement.expr != nullptr) VisitKeywords(*statement.expr, types);
    if (statement.subscript != nullptr) VisitKeywords(*statement.subscript, types);
    for (const StmtPtr& inner : statement.body) VisitKeywords(*inner, types);
  }

  // ---- Loops that starve everything else ----

  void LintLoops(const Stmt& statement) {
    // A task that never waits uses up the budget of every tick, so that others starve.
    const bool is_for = statement.kind == StmtKind::kFor;
    if (is_for || statement.kind == StmtKind::kWhile) {
      const FoldResult folded = statement.expr != nullptr ? Fold(*statement.expr) : FoldResult();
      const bool endless =
          statement.expr == nullptr || (folded.value && folded.value->cell.AsBool());
      const Stmt& body = is_for ? *statement.body[2] : *statement.body[0];
      const bool after = is_for && MayWaitOrLeave(*statement.body[1]);
      if (endless && !after && !MayWaitOrLeave(body)) {
        diagnostics_.Warning(statement.span, "endless loop that never waits").hint =
            "it uses up the instruction budget of every tick; wait in it, for example "
            "self.sleepcs(2);";
      }
    }
    for (const StmtPtr& inner : statement.body) LintLoops(*inner);
  }

  static bool MayWaitOrLeave(const Stmt& statement) {
    if (statement.kind == StmtKind::kReturn || statement.kind == StmtKind::kBreak) return true;
    if (statement.expr != nullptr && MayWait(*statement.expr)) return true;
    if (statement.subscript != nullptr && MayWait(*statement.subscript)) return true;
    return std::any_of(statement.body.begin(), statement.body.end(),
                       [](const StmtPtr& inner) { return MayWaitOrLeave(*inner); });
  }

  static bool MayWait(const Expr& expr) {
    // What a called function does may depend on the role that is played, so it gets the benefit of
    // the doubt.
    if (expr.meaning == Meaning::kMethod || expr.meaning == Meaning::kSuper) return true;
    if (expr.meaning == Meaning::kBuiltin && vm::InfoOf(expr.opcode).effect == vm::Effect::kWait) {
      return true;
    }
    return std::any_of(expr.operands.begin(), expr.operands.end(),
                       [](const ExprPtr& operand) { return MayWait(*operand); });
  }

  const keywords::KeywordTable& keywords_;
  const ProgramModel& model_;
  source::Diagnostics& diagnostics_;
  /// Places of divisions that have been warned of.
  std::set<std::pair<int, size_t>> divisions_;
};

}  // namespace

void Lint(const keywords::KeywordTable& keywords, const ProgramModel& model,
          source::Diagnostics* diagnostics) {
  Linter(keywords, model, diagnostics).Run();
}

}  // namespace morphbus::dynarole
