#include <fmt/format.h>

#include <algorithm>

#include "compiler/m3l/check_condition.h"
#include "compiler/m3l/checker.h"
#include "compiler/m3l/evaluate.h"

namespace morphbus::m3l {
namespace {

/// The two members, or false: reported, or silent because a module is unsound.
bool CheckMembers(const Expr& members, const std::vector<CheckedModule>& modules,
                  CheckedConnection& connection, internal::ConditionScope& scope) {
  // The shape of the attribute comes first; without two members there is nothing to look up.
  if (members.kind != ExprKind::kTuple || members.children.size() != 2) {
    scope.diagnostics.Error(members.span, "a connection has two members").hint =
        "write members=(TYPE a, TYPE b)";
    return false;
  }
  // Both members are looked at even if the first is wrong.
  bool ok = true;
  int* types[2] = {&connection.problem.type_a, &connection.problem.type_b};
  for (size_t i = 0; i < 2; ++i) {
    const Expr& member = members.children[i];
    // Each member is `TYPE name`.
    if (member.kind != ExprKind::kTyped || member.path.size() != 1) {
      scope.diagnostics.Error(member.span, "expected a module type and a name for the member")
          .hint = "write members=(TYPE a, TYPE b)";
      ok = false;
      continue;
    }
    scope.members[i].name = member.bound;
    // The type is looked up among all modules, whatever file they are in.
    const std::optional<int> type =
        FindModuleType(member.path[0].text, member.path[0].span, modules, &scope.diagnostics);
    ok = ok && type.has_value();
    if (!type) continue;
    *types[i] = *type;
    scope.members[i].module = &modules[*type];
  }
  // Conditions tell the members apart by their names.
  if (ok && scope.members[0].name.text == scope.members[1].name.text) {
    scope.diagnostics
        .Error(scope.members[1].name.span,
               "both members are called '" + scope.members[1].name.text + "'")
        .Note(scope.members[0].name.span, "first named here");
    return false;
  }
  return ok;
}

}  // namespace

CheckedConnection CheckConnection(const ConnectionDecl& decl,
                                  const std::vector<CheckedModule>& modules,
                                  source::Diagnostics* diagnostics) {
  const int errors = diagnostics->error_count();
  CheckedConnection connection;
  // The problem takes name and place over for the solver's messages.
  connection.decl = &decl;
  connection.problem.name = decl.name.text;
  connection.problem.span = decl.name.span;
  AttributeReader attributes(decl, "connection '" + decl.name.text + "'", {"members", "conditions"},
                             diagnostics);
  // Without members the names in the conditions mean nothing, so nothing more is said.
  const Expr* members = attributes.Required("members", "write members=(TYPE a, TYPE b)");
  const Expr* conditions =
      attributes.Required("conditions", "write conditions=(a.point p_a coincident b.point p_b)");
  internal::ConditionScope scope{{}, *diagnostics};
  if (!members || !CheckMembers(*members, modules, connection, scope) || !conditions) {
    return connection;
  }
  // The binders must be known before the condition is read, as it may use them before it binds
  // them.
  internal::CollectBinders(*conditions, decl.name.span, scope);
  std::optional<solver::Condition> condition = internal::CheckCondition(*conditions, scope);
  if (!condition) return connection;
  connection.problem.condition = std::move(*condition);
  // Conditions may be sound although a module is not; such a connection is not solved.
  connection.valid = diagnostics->error_count() == errors && !decl.broken &&
                     scope.members[0].module->valid && scope.members[1].module->valid;
  return connection;
}

std::optional<int> FindModuleType(const std::string& name, const source::Span& span,
                                  const std::vector<CheckedModule>& modules,
                                  source::Diagnostics* diagnostics) {
  // The names are kept for the hint.
  std::vector<std::string> names;
  bool nameless = false;
  for (size_t i = 0; i < modules.size(); ++i) {
    if (modules[i].type.name == name) return static_cast<int>(i);
    nameless = nameless || modules[i].type.name.empty();
    names.push_back(modules[i].type.name);
  }
  if (nameless) return std::nullopt;  // It may be the one whose name did not parse.
  diagnostics->Error(span, "there is no module type '" + name + "'").hint =
      NameHint(name, names, "types are");
  return std::nullopt;
}

namespace {

/// c7 and c1, m3 and m10: in names with numbers the number is not mistyped; it is one too many,
/// rather.
bool DifferInNumbersOnly(std::string a, std::string b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::erase_if(a, is_digit);
  std::erase_if(b, is_digit);
  return a == b;
}

}  // namespace

std::string NameHint(const std::string& name, const std::vector<std::string>& candidates,
                     const std::string& what) {
  // A long list of names would not be read.
  constexpr size_t kShown = 12;
  const std::string near = source::NearestName(name, candidates);
  if (!near.empty() && !DifferInNumbersOnly(name, near)) return "did you mean '" + near + "'?";
  if (candidates.empty()) return "";
  // Names in the order of declaration, as many as a person reads.
  std::string list;
  for (size_t i = 0; i < std::min(kShown, candidates.size()); ++i) {
    list += (i ? ", " : "") + candidates[i];
  }
  return what + " " + list + (candidates.size() > kShown ? ", ..." : "");
}

}  // namespace morphbus::m3l
